/* What a scan may touch: members of the `io` of its task, called by name. */

static PyObject *member(Scans *self, int which)
{
    if (self->members[which] == NULL)
        self->members[which] = PyObject_GetAttrString(self->io, member_names[which]);
    return self->members[which];
}

/* Calls a member with up to three arguments, whose references it takes; one that is NULL is an exception already. */
static PyObject *called(Scans *self, int which, size_t count, PyObject *first, PyObject *second, PyObject *third)
{
    PyObject *arguments[] = {first, second, third}, *result = NULL;
    PyObject *function = member(self, which);
    int whole = function != NULL;
    for (size_t k = 0; k < count; k++)
        whole = whole && arguments[k] != NULL;
    if (whole)
        result = PyObject_Vectorcall(function, arguments, count, NULL);
    for (size_t k = 0; k < count; k++)
        Py_XDECREF(arguments[k]);
    return result;
}

static int done(PyObject *result)
{
    Py_XDECREF(result);
    return result == NULL ? -1 : 0;
}

static int host_read(automax_host *host, int64_t view, int64_t element, int kind, automax_slot *value)
{
    PyObject *result =
        called(scans_of(host), READ, 2, PyLong_FromLongLong(view), PyLong_FromLongLong(element), NULL);
    if (result == NULL)
        return -1;
    int problem = memory_slot(result, kind, value);
    Py_DECREF(result);
    return problem;
}

static int host_write(automax_host *host, int64_t view, int64_t element, int kind, automax_slot value)
{
    return done(called(scans_of(host), WRITE, 3, PyLong_FromLongLong(view), object_of(value, kind),
                       PyLong_FromLongLong(element)));
}

static int host_log(automax_host *host, int64_t line, int64_t code)
{
    return done(called(scans_of(host), LOG, 2, PyLong_FromLongLong(line), PyLong_FromLongLong(code), NULL));
}

static int host_errors_logged(automax_host *host, int64_t *logged)
{
    PyObject *result = called(scans_of(host), ERRORS_LOGGED, 0, NULL, NULL, NULL);
    if (result == NULL)
        return -1;
    int truth = PyObject_IsTrue(result);
    Py_DECREF(result);
    *logged = truth;
    return truth < 0 ? -1 : 0;
}

static int host_clear_errors(automax_host *host)
{
    return done(called(scans_of(host), CLEAR_ERRORS, 0, NULL, NULL, NULL));
}

/* Takes a tuple of integers apart: exactly as many as are wanted. */
static int whole_numbers(PyObject *result, Py_ssize_t count, int64_t *numbers)
{
    if (result == NULL)
        return -1;
    if (!PyTuple_Check(result) || PyTuple_GET_SIZE(result) != count) {
        PyErr_Format(PyExc_TypeError, "a scan was given %R in place of %zd values", result, count);
        Py_DECREF(result);
        return -1;
    }
    for (Py_ssize_t k = 0; k < count; k++)
        numbers[k] = PyLong_AsLongLong(PyTuple_GET_ITEM(result, k));
    Py_DECREF(result);
    return PyErr_Occurred() ? -1 : 0;
}

static int host_forces(automax_host *host, int64_t *forced)
{
    Scans *self = scans_of(host);
    return whole_numbers(called(self, FORCES, 0, NULL, NULL, NULL), self->code->written_count, forced);
}

static int host_io_read(automax_host *host, int64_t slot, int64_t place, int64_t *word, int64_t *problem)
{
    int64_t numbers[2];
    if (whole_numbers(
            called(scans_of(host), IO_READ, 2, PyLong_FromLongLong(slot), PyLong_FromLongLong(place), NULL), 2, numbers))
        return -1;
    *word = numbers[0];
    *problem = numbers[1];
    return 0;
}

static int host_io_write(automax_host *host, int64_t slot, int64_t place, int64_t value, int64_t *problem)
{
    PyObject *result = called(scans_of(host), IO_WRITE, 3, PyLong_FromLongLong(slot), PyLong_FromLongLong(place),
                              PyLong_FromLongLong(value));
    if (result == NULL)
        return -1;
    *problem = PyLong_AsLongLong(result);
    Py_DECREF(result);
    return PyErr_Occurred() ? -1 : 0;
}

static const automax_host functions = {host_read,   host_write,   host_log,      host_errors_logged, host_clear_errors,
                                       host_forces, host_io_read, host_io_write, 0};
