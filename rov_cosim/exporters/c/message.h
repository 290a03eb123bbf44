/* Text for the log, the same in every locale. */
#ifndef MESSAGE_H
#define MESSAGE_H

#include "hidden.h"

enum { NUMBER_SIZE = 32, MESSAGE_SIZE = 1024 };

typedef char Message[MESSAGE_SIZE];

/* Write, or add, what printf would; what does not fit is left out. */
void say(Message message, const char *format, ...);
void append(Message message, const char *format, ...);

/* Return a number as "%.{digits}g" writes it in the C locale; `text` is room for it. */
const char *number(double value, int digits, char text[NUMBER_SIZE]);

#endif
