/* What the C text of a task, written by the translator, and the host that calls it agree on.
 *
 * The text of a task begins with this file, so that a cache knows tasks of another version apart. Each task exports:
 *
 *   int automax_scan(automax_slot *state, const automax_slot *latched, automax_slot *out, automax_host *host);
 *   int automax_scan_forced(...);            the same while commons that blocks write may be forced
 *   void automax_columns(automax_slot *state, automax_columns_call *call);
 *
 * `state` has the fields of the layout in their order, an array as its elements one after the other; `latched` follows
 * CompiledTask.latched, `out` CompiledTask.written. BOOLEAN, INTEGER and DOUBLE INTEGER are int64 (0 and 1, or the
 * value), REAL is double. A scan stores the state however it ends; `out` is defined after AUTOMAX_DONE alone. Whoever
 * calls a scan compares `out` with what was latched and writes what differs.
 */
#ifndef AUTOMAX_ABI_H
#define AUTOMAX_ABI_H
#include <float.h>
#include <stdint.h>

#define AUTOMAX_ABI 1

/* Arithmetic of more than 64 bits in between, as old processors have it, would give other bits than Python does. */
#if FLT_EVAL_METHOD != 0
#error "doubles are not computed in 64 bits here"
#endif

typedef union {
    int64_t i;
    double d;
} automax_slot;

/* Kinds of values. */
enum { AUTOMAX_BOOLEAN = 0, AUTOMAX_INTEGER = 1, AUTOMAX_REAL = 2 };

/* How a scan ends: at END, by STOP, with too many statements (too_long_line is set), or because a function of the host
 * said so (it returned something other than 0), or because the room of a call by columns is used up, or where Python
 * raises an exception of its own: a REAL that is not a number made an integer, a division by zero. */
enum {
    AUTOMAX_DONE = 0,
    AUTOMAX_STOPPED = 1,
    AUTOMAX_TOO_LONG = 2,
    AUTOMAX_BROKEN_OFF = 3,
    AUTOMAX_FULL = 4,
    AUTOMAX_FAULT = 5
};

/* What a scan may touch besides; each function returns 0, or something else when the scan is to be broken off. */
typedef struct automax_host automax_host;
struct automax_host {
    int (*read)(automax_host *host, int64_t view, int64_t element, int kind, automax_slot *value);
    int (*write)(automax_host *host, int64_t view, int64_t element, int kind, automax_slot value);
    int (*log)(automax_host *host, int64_t line, int64_t code);
    int (*errors_logged)(automax_host *host, int64_t *logged);
    int (*clear_errors)(automax_host *host);
    int (*forces)(automax_host *host, int64_t *forced); /* one flag for each of CompiledTask.written */
    int (*io_read)(automax_host *host, int64_t slot, int64_t place, int64_t *word, int64_t *problem);
    int (*io_write)(automax_host *host, int64_t slot, int64_t place, int64_t value, int64_t *problem);
    int64_t too_long_line; /* set by the scan with AUTOMAX_TOO_LONG */
};

/* Reads or writes of actual memory, scan by scan: scan k has the rows offsets[k] to offsets[k + 1]. */
typedef struct {
    const int64_t *offsets, *views, *elements;
    const double *values;
} automax_rows;

/* Many scans in one call. Reads are answered from `reads` (offsets NULL: none was recorded, so that a scan which reads
 * is broken off); a scan that reads other places than were recorded, or needs what no recording has (errors_logged,
 * clear_errors, io_read, io_write, forces), is broken off. `writes` with offsets are compared with what the scan
 * writes: place and value; a scan that writes something else is broken off. What scans write and log is noted in order,
 * if there is room for it. `done` counts the scans that came to END; `ended` is how the one after them ended, or
 * AUTOMAX_DONE if there was none. After that the state is not that of any scan: the caller begins again from its own. */
typedef struct {
    int64_t count;
    const automax_slot *const *latched; /* a column for each latched common */
    automax_slot *const *outputs;       /* a column for each written one */
    automax_rows reads, writes;
    int64_t error_room, errors;
    int64_t *error_scans, *error_lines, *error_codes;
    int64_t written_room, written;
    int64_t *written_scans, *written_views, *written_elements;
    double *written_values;
    int64_t done;
    int ended;
} automax_columns_call;

#endif
