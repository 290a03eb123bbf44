#ifndef HIDDEN_H
#define HIDDEN_H

/* To be included after the system's headers: what follows stays inside the binary, whatever the compiler's flags are. A name
   of the host's would else take the place of ours. The functions of FMI declare themselves visible. */
#if defined(__GNUC__) && !defined(_WIN32)
#pragma GCC visibility push(hidden)
#endif

#endif
