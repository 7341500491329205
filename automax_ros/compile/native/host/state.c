/* The state: from the list of the layout to slots and back. */

static int fits(const field_spec *field, automax_slot slot)
{
    return field->kind != AUTOMAX_INTEGER || (field->low <= slot.i && slot.i <= field->high);
}

/* Takes the state over from the list; returns 0, 1 where C cannot hold it, or -1 with an exception. */
static int load(Scans *self)
{
    const Code *code = self->code;
    if (PyList_GET_SIZE(self->state) != code->field_count) {
        PyErr_Format(PyExc_ValueError, "a state of %zd fields where the task has %zd", PyList_GET_SIZE(self->state),
                     code->field_count);
        return -1;
    }
    automax_slot *slot = self->values;
    for (Py_ssize_t k = 0; k < code->field_count; k++) {
        const field_spec *field = &code->fields[k];
        PyObject *held = PyList_GET_ITEM(self->state, k);
        if (!field->is_array) {
            if (exact_slot(held, field->kind, slot) || !fits(field, *slot))
                return 1;
            slot++;
            continue;
        }
        if (!PyList_CheckExact(held) || PyList_GET_SIZE(held) != field->size)
            return 1;
        for (Py_ssize_t n = 0; n < field->size; n++, slot++)
            if (exact_slot(PyList_GET_ITEM(held, n), field->kind, slot) || !fits(field, *slot))
                return 1;
    }
    memcpy(self->loaded, self->values, sizeof(automax_slot) * code->slots);
    return 0;
}

static int store_one(PyObject *list, Py_ssize_t place, automax_slot value, int kind)
{
    PyObject *object = object_of(value, kind);
    return object == NULL ? -1 : PyList_SetItem(list, place, object);
}

/* Puts into the list what is no longer as it was loaded. */
static int store(Scans *self)
{
    const Code *code = self->code;
    const automax_slot *slot = self->values, *before = self->loaded;
    for (Py_ssize_t k = 0; k < code->field_count; slot += code->fields[k].size, before += code->fields[k].size, k++) {
        const field_spec *field = &code->fields[k];
        if (!memcmp(slot, before, sizeof(automax_slot) * field->size))
            continue;
        if (!field->is_array) {
            if (store_one(self->state, k, *slot, field->kind))
                return -1;
            continue;
        }
        PyObject *held = PyList_GetItem(self->state, k);
        if (held == NULL || !PyList_Check(held))
            return -1;
        for (Py_ssize_t n = 0; n < field->size; n++)
            if (slot[n].i != before[n].i && store_one(held, n, slot[n], field->kind))
                return -1;
    }
    return 0;
}

/* Ends the scans: the list has the state again, whether an exception is on its way or not. */
static int finish(Scans *self)
{
    int was_ready = self->stage == READY;
    self->stage = OVER;
    if (!was_ready)
        return 0;
    PyObject *type, *value, *trace;
    PyErr_Fetch(&type, &value, &trace);
    int problem = store(self);
    if (type != NULL)
        PyErr_Restore(type, value, trace); /* what broke the scan off counts for more than that */
    return problem;
}
