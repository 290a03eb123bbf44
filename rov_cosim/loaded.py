"""When this process began to load the package: what was edited later may not be what it runs."""

import time

AT = time.time()
