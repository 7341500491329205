/* The functions that a task exports: one scan, and many (abi.h). */

static const int64_t free_of_forces[AUTOMAX_WRITTEN + 1];

int automax_scan(automax_slot *slots, const automax_slot *latched, automax_slot *out, automax_host *host) {
    const automax_slot *columns[AUTOMAX_LATCHED + 1];
    automax_slot *outputs[AUTOMAX_WRITTEN + 1];
    for (int place = 0; place < AUTOMAX_LATCHED; place++) columns[place] = &latched[place];
    for (int place = 0; place < AUTOMAX_WRITTEN; place++) outputs[place] = &out[place];
    return scan((state *)slots, columns, outputs, 0, free_of_forces, host);
}

int automax_scan_forced(automax_slot *slots, const automax_slot *latched, automax_slot *out, automax_host *host) {
    const automax_slot *columns[AUTOMAX_LATCHED + 1];
    automax_slot *outputs[AUTOMAX_WRITTEN + 1];
    int64_t forced[AUTOMAX_WRITTEN + 1];
    for (int place = 0; place < AUTOMAX_LATCHED; place++) columns[place] = &latched[place];
    for (int place = 0; place < AUTOMAX_WRITTEN; place++) outputs[place] = &out[place];
    if (host->forces(host, forced)) return AUTOMAX_BROKEN_OFF;
    return scan((state *)slots, columns, outputs, 0, forced, host);
}

/* The host of scans by columns: what a recording holds answers the reads, what is written and logged is noted. */
typedef struct {
    automax_host host;
    automax_columns_call *call;
    int64_t scan, read, written, ended;
} replaying_host;

static int end_by(replaying_host *host, int how) {
    host->ended = how;
    return 1;
}

static int replayed_read(automax_host *base, int64_t view, int64_t element, int kind, automax_slot *value) {
    replaying_host *host = (replaying_host *)base;
    const automax_rows *rows = &host->call->reads;
    int64_t row = host->read;
    if (rows->offsets == NULL || row >= rows->offsets[host->scan + 1] || rows->views[row] != view ||
        rows->elements[row] != element)
        return end_by(host, AUTOMAX_BROKEN_OFF);
    double found = rows->values[row];
    host->read++;
    if (kind == AUTOMAX_REAL)
        value->d = found;
    else if (found >= -2147483648.0 && found <= 2147483647.0)
        value->i = (int64_t)found;
    else
        return end_by(host, AUTOMAX_BROKEN_OFF);
    return 0;
}

static int replayed_write(automax_host *base, int64_t view, int64_t element, int kind, automax_slot value) {
    replaying_host *host = (replaying_host *)base;
    automax_columns_call *call = host->call;
    double written = kind == AUTOMAX_REAL ? value.d : (double)value.i;
    if (call->writes.offsets != NULL) {
        int64_t row = host->written++;
        if (row >= call->writes.offsets[host->scan + 1] || call->writes.views[row] != view ||
            call->writes.elements[row] != element || call->writes.values[row] != written)
            return end_by(host, AUTOMAX_BROKEN_OFF);
    }
    if (call->written >= call->written_room) return end_by(host, AUTOMAX_FULL);
    call->written_scans[call->written] = host->scan;
    call->written_views[call->written] = view;
    call->written_elements[call->written] = element;
    call->written_values[call->written++] = written;
    return 0;
}

static int replayed_log(automax_host *base, int64_t line, int64_t code) {
    replaying_host *host = (replaying_host *)base;
    automax_columns_call *call = host->call;
    if (call->errors >= call->error_room) return end_by(host, AUTOMAX_FULL);
    call->error_scans[call->errors] = host->scan;
    call->error_lines[call->errors] = line;
    call->error_codes[call->errors++] = code;
    return 0;
}

static int not_recorded_flag(automax_host *host, int64_t *flag) {
    (void)flag;
    return end_by((replaying_host *)host, AUTOMAX_BROKEN_OFF);
}

static int not_recorded(automax_host *host) { return end_by((replaying_host *)host, AUTOMAX_BROKEN_OFF); }

static int register_not_recorded(automax_host *host, int64_t slot, int64_t place, int64_t *word, int64_t *problem) {
    (void)slot, (void)place, (void)word, (void)problem;
    return end_by((replaying_host *)host, AUTOMAX_BROKEN_OFF);
}

static int register_not_written(automax_host *host, int64_t slot, int64_t place, int64_t value, int64_t *problem) {
    (void)slot, (void)place, (void)value, (void)problem;
    return end_by((replaying_host *)host, AUTOMAX_BROKEN_OFF);
}

/* The number of scans from the first on whose latched values are of their types: a recording may hold anything. */
static int64_t typed_scans(const automax_columns_call *call) {
    int64_t count = call->count;
    for (int place = 0; place < AUTOMAX_LATCHED; place++) {
        const automax_slot *column = call->latched[place];
        int64_t low = latched_low[place], high = latched_high[place], outside = 0;
        for (int64_t k = 0; k < count; k++) outside |= (column[k].i < low) | (column[k].i > high);
        if (!outside) continue;
        for (int64_t k = 0; k < count; k++)
            if (column[k].i < low || column[k].i > high) count = k;
    }
    return count;
}

void automax_columns(automax_slot *slots, automax_columns_call *call) {
    replaying_host host = {
        .host = {replayed_read, replayed_write, replayed_log, not_recorded_flag, not_recorded, not_recorded_flag,
                 register_not_recorded, register_not_written, 0},
        .call = call,
    };
    int64_t typed = typed_scans(call);
    call->errors = call->written = call->done = 0;
    for (int64_t k = 0; k < typed; k++) {
        int64_t errors = call->errors, written = call->written;
        host.scan = k;
        if (call->reads.offsets != NULL) host.read = call->reads.offsets[k];
        if (call->writes.offsets != NULL) host.written = call->writes.offsets[k];
        int ended = scan((state *)slots, call->latched, call->outputs, k, free_of_forces, &host.host);
        if (ended == AUTOMAX_BROKEN_OFF && host.ended != 0) ended = (int)host.ended;
        if (ended == AUTOMAX_DONE && ((call->reads.offsets != NULL && host.read != call->reads.offsets[k + 1]) ||
                                      (call->writes.offsets != NULL && host.written != call->writes.offsets[k + 1])))
            ended = AUTOMAX_BROKEN_OFF;
        if (ended != AUTOMAX_DONE) {
            call->errors = errors;
            call->written = written;
            call->ended = ended;
            return;
        }
        call->done++;
    }
    call->ended = typed < call->count ? AUTOMAX_BROKEN_OFF : AUTOMAX_DONE;
}
