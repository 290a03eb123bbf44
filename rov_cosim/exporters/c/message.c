#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "message.h"

void say(Message message, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, MESSAGE_SIZE, format, arguments);
    va_end(arguments);
}

void append(Message message, const char *format, ...) {
    size_t used = strlen(message);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(&message[used], MESSAGE_SIZE - used, format, arguments);
    va_end(arguments);
}

const char *number(double value, int digits, char text[NUMBER_SIZE]) {
    if (isnan(value))
        return "nan"; /* printf may add a sign */
    snprintf(text, NUMBER_SIZE, "%.*g", digits, value);
    char *to = text;
    for (const char *from = text; *from; from++) {
        if (strchr("+-.0123456789efin", *from))
            *to++ = *from;
        else if (to > text && to[-1] != '.')
            *to++ = '.'; /* the decimal sign of another locale, of one byte or more */
    }
    *to = 0;
    return text;
}
