/* Finds the fields of CDR messages (classic, little-endian). The bytes are anybody's: no length is used before it is
 * compared with what is left of the message.
 *
 * FIND makes a function that finds the `numbers` of a message, and `places` (in the message) and `counts` (in items) of
 * its texts and sequences. It returns
 *   0: malformed, or only the scalar decoder can tell; what it has found means nothing
 *   1: it fits
 *   2: it fits, and has texts in a sequence */
#ifndef AUTOMAX_CDR_FIELDS_H
#define AUTOMAX_CDR_FIELDS_H
#include <stdint.h>
#include <string.h>

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "numbers are read as they stand in the bytes"
#endif

#define HEADER_BYTES 4
#define NS_PER_S 1000000000

#define ROOM(bytes)                                                                                                    \
    if ((int64_t)(bytes) > length - place) return 0;
#define ALIGN(bytes) place += (HEADER_BYTES - place) & ((int64_t)(bytes) - 1);
#define TAKE(type, name)                                                                                               \
    type name;                                                                                                         \
    ALIGN(sizeof(type))                                                                                                \
    ROOM(sizeof(type))                                                                                                 \
    memcpy(&name, message + place, sizeof(type));                                                                      \
    place += (int64_t)sizeof(type);

#define NUMBER(number, type)                                                                                           \
    {                                                                                                                  \
        TAKE(type, value)                                                                                              \
        numbers[number] = (int64_t)value;                                                                              \
    }
#define TIME(number)                                                                                                   \
    {                                                                                                                  \
        TAKE(int32_t, seconds)                                                                                         \
        TAKE(uint32_t, rest)                                                                                           \
        if (rest >= NS_PER_S) return 0;                                                                                \
        numbers[number] = (int64_t)seconds * NS_PER_S + rest;                                                          \
    }
#define LIST(list, alignment, bytes)                                                                                   \
    {                                                                                                                  \
        TAKE(uint32_t, items)                                                                                          \
        if (items) {                                                                                                   \
            ALIGN(alignment)                                                                                           \
            ROOM((int64_t)items * (bytes))                                                                             \
        }                                                                                                              \
        places[list] = place;                                                                                          \
        counts[list] = items;                                                                                          \
        place += (int64_t)items * (bytes);                                                                             \
    }
/* A text with a letter that is not ASCII is left to the scalar decoder. */
#define TEXT(list, alignment, bytes)                                                                                   \
    LIST(list, alignment, bytes)                                                                                       \
    if (counts[list] && (message[place - 1] || !is_ascii(message + places[list], counts[list]))) return 0;             \
    counts[list] -= counts[list] > 0;
#define TEXTS()                                                                                                        \
    {                                                                                                                  \
        TAKE(uint32_t, texts)                                                                                          \
        for (uint32_t text = 0; text < texts; text++) {                                                                \
            TAKE(uint32_t, bytes)                                                                                      \
            ROOM(bytes)                                                                                                \
            if (bytes && (message[place + bytes - 1] || !is_ascii(message + place, bytes))) return 0;                  \
            place += bytes;                                                                                            \
            fits = 2;                                                                                                  \
        }                                                                                                              \
    }

#define FIND(function, ...)                                                                                            \
    int function(                                                                                                      \
        const uint8_t *message, int64_t length, int64_t *numbers, int64_t *places, int64_t *counts                     \
    ) {                                                                                                                \
        int64_t place = HEADER_BYTES;                                                                                  \
        int fits = 1;                                                                                                  \
        if (length < HEADER_BYTES || memcmp(message, "\0\1\0\0", HEADER_BYTES)) return 0;                              \
        __VA_ARGS__                                                                                                    \
        return length - place <= MAX_TRAILING ? fits : 0;                                                              \
    }

static int is_ascii(const uint8_t *text, int64_t length) {
    for (int64_t letter = 0; letter < length; letter++)
        if (text[letter] & 0x80) return 0;
    return 1;
}
#endif
