/* The host of native scans: what a task holds in place of a generator, and what carries values between it and C.
 *
 * The text of abi.h stands before this one. Code(path, fields, latched, written, too_long) is a task's library;
 * scans(python, state, io) and scans_forced give an iterator with close(), which does what the generator does that the
 * compiler makes of the same task: each next() is a scan, close() stores the state, an exception does so too. `python`
 * makes that generator; it scans where the state holds what the C text is not made for.
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <dlfcn.h>
#include <stddef.h>
#include <string.h>

typedef int (*scan_function)(automax_slot *, const automax_slot *, automax_slot *, automax_host *);

typedef struct {
    Py_ssize_t size;
    int kind, is_array;
    int64_t low, high;
} field_spec;

typedef struct {
    int kind;
    Py_ssize_t view;
} latched_spec;

typedef struct {
    Py_ssize_t latched;
    PyObject *view;
} written_spec;

typedef struct {
    PyObject_HEAD
    void *library;
    scan_function scan, scan_forced;
    field_spec *fields;
    Py_ssize_t field_count, slots;
    latched_spec *latched;
    Py_ssize_t latched_count;
    written_spec *written;
    Py_ssize_t written_count;
    PyObject *too_long;
} Code;

/* Members of an `io` that are asked for when they are needed first. */
enum { READ, WRITE, LOG, ERRORS_LOGGED, CLEAR_ERRORS, FORCES, IO_READ, IO_WRITE, COMMIT, MEMBERS };
static const char *const member_names[MEMBERS] = {"read_now", "write_now", "log",     "errors_logged", "clear_errors",
                                                  "forces",   "io_read",   "io_write", "commit"};

enum { FRESH, READY, OVER };

typedef struct {
    PyObject_HEAD
    automax_host host;
    Code *code;
    scan_function scan;
    PyObject *make_python, *python, *state, *io, *latch, *cells;
    Py_buffer gate; /* of a commit into these cells without a call: obj is NULL where there is none */
    PyObject *members[MEMBERS];
    PyObject **seen; /* for each latched common the object that its slot was made of */
    Py_ssize_t seen_count;
    automax_slot *values, *loaded, *latched, *out;
    int stage, running;
} Scans;

static Scans *scans_of(automax_host *host) { return (Scans *)((char *)host - offsetof(Scans, host)); }

static PyObject *object_of(automax_slot value, int kind)
{
    if (kind == AUTOMAX_BOOLEAN)
        return PyBool_FromLong(value.i != 0);
    return kind == AUTOMAX_REAL ? PyFloat_FromDouble(value.d) : PyLong_FromLongLong(value.i);
}

/* Takes a value of exactly the type of its kind; returns 0, or 1 without an exception where it is another. */
static int exact_slot(PyObject *object, int kind, automax_slot *slot)
{
    if (kind == AUTOMAX_BOOLEAN) {
        slot->i = object == Py_True;
        return !PyBool_Check(object);
    }
    if (kind == AUTOMAX_REAL) {
        if (!PyFloat_CheckExact(object))
            return 1;
        slot->d = PyFloat_AS_DOUBLE(object);
        return 0;
    }
    int overflow = 0;
    if (!PyLong_CheckExact(object))
        return 1;
    slot->i = PyLong_AsLongLongAndOverflow(object, &overflow);
    return overflow != 0;
}

/* The same for values of memory, where a number of another type counts as what it is; returns -1 with an exception. */
static int memory_slot(PyObject *object, int kind, automax_slot *slot)
{
    if (!exact_slot(object, kind, slot))
        return 0;
    if (kind == AUTOMAX_REAL)
        slot->d = PyFloat_AsDouble(object);
    else
        slot->i = PyLong_AsLongLong(object);
    return PyErr_Occurred() ? -1 : 0;
}
