/* A task's library, and the module that Python imports. */

static PyObject *new_scans(Code *code, scan_function scan, PyObject *arguments)
{
    PyObject *python, *state, *io;
    if (!PyArg_ParseTuple(arguments, "OO!O", &python, &PyList_Type, &state, &io))
        return NULL;
    Scans *self = (Scans *)scans_type->tp_alloc(scans_type, 0);
    if (self == NULL)
        return NULL;
    self->host = functions;
    self->scan = scan;
    self->code = (Code *)Py_NewRef(code);
    self->make_python = Py_NewRef(python);
    self->state = Py_NewRef(state);
    self->io = Py_NewRef(io);
    size_t count = 2 * code->slots + code->latched_count + code->written_count;
    self->values = PyMem_Calloc(count ? count : 1, sizeof(automax_slot));
    self->seen = PyMem_Calloc(code->latched_count + 1, sizeof(PyObject *));
    if (self->values == NULL || self->seen == NULL) {
        Py_DECREF(self);
        return PyErr_NoMemory();
    }
    self->seen_count = code->latched_count;
    self->loaded = self->values + code->slots;
    self->latched = self->loaded + code->slots;
    self->out = self->latched + code->latched_count;
    return (PyObject *)self;
}

static PyObject *code_scans(Code *self, PyObject *arguments) { return new_scans(self, self->scan, arguments); }

static PyObject *code_scans_forced(Code *self, PyObject *arguments)
{
    return new_scans(self, self->scan_forced, arguments);
}

static int take_fields(Code *self, PyObject *fields)
{
    self->field_count = PyTuple_GET_SIZE(fields);
    self->fields = PyMem_Calloc(self->field_count + 1, sizeof(field_spec));
    if (self->fields == NULL)
        return -1;
    for (Py_ssize_t k = 0; k < self->field_count; k++) {
        field_spec *field = &self->fields[k];
        long long low, high;
        if (!PyArg_ParseTuple(PyTuple_GET_ITEM(fields, k), "inpLL", &field->kind, &field->size, &field->is_array, &low,
                              &high))
            return -1;
        field->low = low;
        field->high = high;
        self->slots += field->size;
    }
    return 0;
}

static int take_latched(Code *self, PyObject *latched)
{
    self->latched_count = PyTuple_GET_SIZE(latched);
    self->latched = PyMem_Calloc(self->latched_count + 1, sizeof(latched_spec));
    if (self->latched == NULL)
        return -1;
    for (Py_ssize_t k = 0; k < self->latched_count; k++)
        if (!PyArg_ParseTuple(PyTuple_GET_ITEM(latched, k), "in", &self->latched[k].kind, &self->latched[k].view))
            return -1;
    return 0;
}

static int take_written(Code *self, PyObject *written)
{
    self->written = PyMem_Calloc(PyTuple_GET_SIZE(written) + 1, sizeof(written_spec));
    if (self->written == NULL)
        return -1;
    for (Py_ssize_t k = 0; k < PyTuple_GET_SIZE(written); k++) {
        if (!PyArg_ParseTuple(PyTuple_GET_ITEM(written, k), "nO", &self->written[k].latched, &self->written[k].view))
            return -1;
        Py_INCREF(self->written[k].view);
        self->written_count++;
    }
    return 0;
}

static int open_library(Code *self, const char *path)
{
    self->library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (self->library != NULL) {
        *(void **)&self->scan = dlsym(self->library, "automax_scan");
        *(void **)&self->scan_forced = dlsym(self->library, "automax_scan_forced");
    }
    if (self->library != NULL && self->scan != NULL && self->scan_forced != NULL)
        return 0;
    const char *why = dlerror();
    PyErr_SetString(PyExc_OSError, why ? why : "a native task lacks its scans");
    return -1;
}

static PyObject *code_new(PyTypeObject *type, PyObject *arguments, PyObject *Py_UNUSED(words))
{
    const char *path;
    PyObject *fields, *latched, *written, *too_long;
    if (!PyArg_ParseTuple(arguments, "yO!O!O!O", &path, &PyTuple_Type, &fields, &PyTuple_Type, &latched, &PyTuple_Type,
                          &written, &too_long))
        return NULL;
    Code *self = (Code *)type->tp_alloc(type, 0);
    if (self == NULL)
        return NULL;
    self->too_long = Py_NewRef(too_long);
    if (take_fields(self, fields) || take_latched(self, latched) || take_written(self, written) ||
        open_library(self, path)) {
        if (!PyErr_Occurred())
            PyErr_NoMemory();
        Py_DECREF(self);
        return NULL;
    }
    return (PyObject *)self;
}

static void code_dealloc(Code *self)
{
    PyTypeObject *type = Py_TYPE(self);
    for (Py_ssize_t k = 0; k < self->written_count; k++)
        Py_DECREF(self->written[k].view);
    PyMem_Free(self->fields);
    PyMem_Free(self->latched);
    PyMem_Free(self->written);
    Py_XDECREF(self->too_long);
    if (self->library != NULL)
        dlclose(self->library);
    type->tp_free(self);
    Py_DECREF(type);
}

static PyMethodDef code_methods[] = {
    {"scans", (PyCFunction)code_scans, METH_VARARGS, "Return the scans of a state."},
    {"scans_forced", (PyCFunction)code_scans_forced, METH_VARARGS, "The same, heeding forces."},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot code_slots[] = {
    {Py_tp_doc, "Code(path, fields, latched, written, too_long): the library of a native task."},
    {Py_tp_new, code_new},
    {Py_tp_methods, code_methods},
    {Py_tp_dealloc, code_dealloc},
    {0, NULL},
};

static PyType_Spec code_spec = {
    .name = "automax_host.Code",
    .basicsize = sizeof(Code),
    .flags = Py_TPFLAGS_DEFAULT,
    .slots = code_slots,
};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT, "automax_host", "Native scans for Python.", -1, NULL, NULL, NULL, NULL, NULL,
};

PyMODINIT_FUNC PyInit_automax_host(void)
{
    PyObject *module = PyModule_Create(&definition);
    PyObject *code = PyType_FromSpec(&code_spec);
    scans_type = (PyTypeObject *)PyType_FromSpec(&scans_spec);
    if (module == NULL || code == NULL || scans_type == NULL || PyModule_AddObject(module, "Code", code)) {
        Py_XDECREF(module);
        Py_XDECREF(code);
        return NULL;
    }
    return module;
}
