/* The scans of a task: an iterator with close(), as a generator is one. */

/* Takes the value of a cell that holds another object than in the scan before; that one is kept until then. */
static int latch_cell(Scans *self, Py_ssize_t k, PyObject *value)
{
    PyObject *before = self->seen[k];
    self->seen[k] = NULL;
    Py_XDECREF(before);
    if (memory_slot(value, self->code->latched[k].kind, &self->latched[k]))
        return -1;
    self->seen[k] = Py_NewRef(value);
    return 0;
}

/* Reads the cells that a latch would copy: the latched values as they are now. Most hold the object that they held. */
static int latch_cells(Scans *self)
{
    const Code *code = self->code;
    for (Py_ssize_t k = 0; k < code->latched_count; k++) {
        PyObject *value = PyList_GetItem(self->cells, code->latched[k].view);
        if (value == NULL)
            return -1;
        if (value == self->seen[k])
            continue;
        Py_INCREF(value);
        int problem = latch_cell(self, k, value);
        Py_DECREF(value);
        if (problem)
            return -1;
    }
    return 0;
}

static int latch(Scans *self)
{
    if (self->cells != NULL)
        return latch_cells(self);
    const Code *code = self->code;
    PyObject *values = PyObject_CallNoArgs(self->latch);
    if (values == NULL)
        return -1;
    int problem = 0;
    if (!PyTuple_Check(values) || PyTuple_GET_SIZE(values) != code->latched_count) {
        PyErr_Format(PyExc_ValueError, "a latch gave %R where the task latches %zd values", values, code->latched_count);
        problem = -1;
    }
    for (Py_ssize_t k = 0; !problem && k < code->latched_count; k++)
        problem = memory_slot(PyTuple_GET_ITEM(values, k), code->latched[k].kind, &self->latched[k]);
    Py_DECREF(values);
    return problem;
}

static int add_change(PyObject **changes, PyObject *view, automax_slot value, int kind)
{
    PyObject *object = object_of(value, kind), *pair = NULL;
    if (object != NULL)
        pair = PyTuple_Pack(2, view, object);
    Py_XDECREF(object);
    if (pair != NULL && *changes == NULL)
        *changes = PyList_New(0);
    int problem = pair == NULL || *changes == NULL || PyList_Append(*changes, pair);
    Py_XDECREF(pair);
    return problem ? -1 : 0;
}

static int differs(automax_slot now, automax_slot before, int kind)
{
    return kind == AUTOMAX_REAL ? now.d != before.d : now.i != before.i;
}

/* Stores what differs from the latch into the cells: all that a commit does while the gate is open. The objects count
 * as latched, since the next scan finds them there. */
static int commit_cells(Scans *self)
{
    const Code *code = self->code;
    for (Py_ssize_t k = 0; k < code->written_count; k++) {
        Py_ssize_t place = code->written[k].latched;
        const latched_spec *latched = &code->latched[place];
        automax_slot now = self->out[k];
        if (!differs(now, self->latched[place], latched->kind))
            continue;
        PyObject *value = object_of(now, latched->kind), *before = self->seen[place];
        if (value == NULL || PyList_SetItem(self->cells, latched->view, Py_NewRef(value))) {
            Py_XDECREF(value);
            return -1;
        }
        self->latched[place] = now;
        self->seen[place] = value;
        Py_XDECREF(before);
        ((int64_t *)self->gate.buf)[1]++;
    }
    return 0;
}

static int commit(Scans *self)
{
    if (self->gate.obj != NULL && ((const int64_t *)self->gate.buf)[0])
        return commit_cells(self);
    const Code *code = self->code;
    PyObject *changes = NULL;
    for (Py_ssize_t k = 0; k < code->written_count; k++) {
        const written_spec *written = &code->written[k];
        int kind = code->latched[written->latched].kind;
        automax_slot before = self->latched[written->latched], now = self->out[k];
        if (differs(now, before, kind) && add_change(&changes, written->view, now, kind)) {
            Py_XDECREF(changes);
            return -1;
        }
    }
    return changes == NULL ? 0 : done(called(self, COMMIT, 1, changes, NULL, NULL));
}

static void raise_too_long(Scans *self)
{
    PyObject *error = PyObject_CallFunction(self->code->too_long, "L", (long long)self->host.too_long_line);
    if (error != NULL)
        PyErr_SetObject(self->code->too_long, error);
    Py_XDECREF(error);
}

static PyObject *one_scan(Scans *self)
{
    if (latch(self))
        return NULL;
    int ended = self->scan(self->values, self->latched, self->out, &self->host);
    if (ended == AUTOMAX_DONE)
        return commit(self) ? NULL : Py_NewRef(Py_False);
    if (ended == AUTOMAX_STOPPED)
        return Py_NewRef(Py_True);
    if (ended == AUTOMAX_TOO_LONG)
        raise_too_long(self);
    else if (!PyErr_Occurred()) /* where Python raises an exception of its own */
        PyErr_SetString(PyExc_ArithmeticError, "a scan computed what has no value");
    return NULL;
}

/* Returns an attribute of the io, or NULL without an exception where it has none. */
static PyObject *optional(PyObject *object, const char *name)
{
    PyObject *found = PyObject_GetAttrString(object, name);
    if (found == NULL && PyErr_ExceptionMatches(PyExc_AttributeError))
        PyErr_Clear();
    return found;
}

/* Takes the latch of the io, and its cells where it has some. */
static int bind_latch(Scans *self)
{
    self->latch = PyObject_GetAttrString(self->io, "latch");
    if (self->latch == NULL)
        return -1;
    self->cells = optional(self->latch, "cells");
    if (self->cells != NULL && !PyList_CheckExact(self->cells))
        Py_CLEAR(self->cells);
    return PyErr_Occurred() ? -1 : 0;
}

/* Whether all that the task writes are plain cells. */
static int writes_plain(const Code *code, PyObject *plain)
{
    for (Py_ssize_t k = 0; k < code->written_count; k++) {
        Py_ssize_t view = code->latched[code->written[k].latched].view;
        if (!PyList_CheckExact(plain) || view >= PyList_GET_SIZE(plain) || PyList_GET_ITEM(plain, view) != Py_True)
            return 0;
    }
    return 1;
}

/* Takes the gate of a commit where it may go into the cells that are latched. */
static int take_gate(Scans *self, PyObject *commit)
{
    PyObject *cells, *plain, *gate;
    if (!PyArg_ParseTuple(commit, "OOO", &cells, &plain, &gate))
        return -1;
    if (cells != self->cells || !writes_plain(self->code, plain))
        return 0;
    if (PyObject_GetBuffer(gate, &self->gate, PyBUF_WRITABLE))
        return -1;
    if (self->gate.len == 2 * (Py_ssize_t)sizeof(int64_t))
        return 0;
    PyErr_SetString(PyExc_ValueError, "the gate of a commit is not two integers of 64 bits");
    return -1;
}

/* Looks whether a commit may go without a call (runtime/memory/views.py, CellCommit). */
static int bind_commit(Scans *self)
{
    PyObject *commit = self->cells == NULL ? NULL : optional(self->io, "cell_commit");
    int problem = commit != NULL && commit != Py_None && take_gate(self, commit);
    Py_XDECREF(commit);
    return problem || PyErr_Occurred() ? -1 : 0;
}

static int begin(Scans *self)
{
    int misfit = load(self);
    if (!misfit) {
        self->stage = READY;
        return bind_latch(self) || bind_commit(self) ? -1 : 0;
    }
    if (misfit < 0)
        return -1;
    self->python = PyObject_CallFunctionObjArgs(self->make_python, self->state, self->io, NULL);
    return self->python == NULL ? -1 : 0;
}

static int refuse_inside(Scans *self)
{
    if (self->running)
        PyErr_SetString(PyExc_ValueError, "a scan is being executed");
    return self->running;
}

static PyObject *scans_next(Scans *self)
{
    if (self->stage == OVER || refuse_inside(self))
        return NULL;
    if (self->stage == FRESH && self->python == NULL && begin(self)) {
        finish(self);
        return NULL;
    }
    if (self->python != NULL)
        return Py_TYPE(self->python)->tp_iternext(self->python);
    self->running = 1;
    PyObject *result = one_scan(self);
    self->running = 0;
    if (result == NULL)
        finish(self);
    return result;
}

static PyObject *scans_close(Scans *self, PyObject *Py_UNUSED(nothing))
{
    if (refuse_inside(self))
        return NULL;
    if (self->python != NULL)
        return PyObject_CallMethod(self->python, "close", NULL);
    if (finish(self))
        return NULL;
    Py_RETURN_NONE;
}

static int scans_traverse(Scans *self, visitproc visit, void *arg)
{
    Py_VISIT(Py_TYPE(self));
    Py_VISIT(self->code);
    Py_VISIT(self->make_python);
    Py_VISIT(self->python);
    Py_VISIT(self->state);
    Py_VISIT(self->io);
    Py_VISIT(self->latch);
    Py_VISIT(self->cells);
    Py_VISIT(self->gate.obj);
    for (int k = 0; k < MEMBERS; k++)
        Py_VISIT(self->members[k]);
    for (Py_ssize_t k = 0; k < self->seen_count; k++)
        Py_VISIT(self->seen[k]);
    return 0;
}

static int scans_clear(Scans *self)
{
    self->stage = OVER;
    Py_CLEAR(self->code);
    Py_CLEAR(self->make_python);
    Py_CLEAR(self->python);
    Py_CLEAR(self->state);
    Py_CLEAR(self->io);
    Py_CLEAR(self->latch);
    Py_CLEAR(self->cells);
    PyBuffer_Release(&self->gate);
    for (int k = 0; k < MEMBERS; k++)
        Py_CLEAR(self->members[k]);
    for (Py_ssize_t k = 0; k < self->seen_count; k++)
        Py_CLEAR(self->seen[k]);
    return 0;
}

static void scans_finalize(PyObject *object)
{
    Scans *self = (Scans *)object;
    if (self->stage == READY && finish(self))
        PyErr_WriteUnraisable(object);
}

static void scans_dealloc(Scans *self)
{
    if (PyObject_CallFinalizerFromDealloc((PyObject *)self) < 0)
        return;
    PyTypeObject *type = Py_TYPE(self);
    PyObject_GC_UnTrack(self);
    scans_clear(self);
    PyMem_Free(self->seen);
    PyMem_Free(self->values);
    type->tp_free(self);
    Py_DECREF(type);
}

static PyMethodDef scans_methods[] = {
    {"close", (PyCFunction)scans_close, METH_NOARGS, "Store the state and scan no more."},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot scans_slots[] = {
    {Py_tp_doc, "Scans of one task: next() is a scan, and says whether it executed STOP."},
    {Py_tp_iter, PyObject_SelfIter},
    {Py_tp_iternext, scans_next},
    {Py_tp_methods, scans_methods},
    {Py_tp_traverse, scans_traverse},
    {Py_tp_clear, scans_clear},
    {Py_tp_finalize, scans_finalize},
    {Py_tp_dealloc, scans_dealloc},
    {0, NULL},
};

static PyType_Spec scans_spec = {
    .name = "automax_host.Scans",
    .basicsize = sizeof(Scans),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC | Py_TPFLAGS_DISALLOW_INSTANTIATION,
    .slots = scans_slots,
};

static PyTypeObject *scans_type;
