"""The vehicle, the arm and the controller: equations and declared interfaces, free of FMI."""
