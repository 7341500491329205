/* Calls of the host. After one that broke the scan off, the others of its statement do nothing. */

static inline automax_slot read_slot(automax_host *host, int64_t view, int64_t element, int kind, int *ended) {
    automax_slot value = {0};
    if (*ended == 0 && host->read(host, view, element, kind, &value)) *ended = AUTOMAX_BROKEN_OFF;
    return value;
}

static inline bool read_bool(automax_host *host, int64_t view, int64_t element, int kind, int *ended) {
    return read_slot(host, view, element, kind, ended).i != 0;
}

/* A recording may hold what no common of the type does. */
static inline int64_t read_whole(automax_host *host, int64_t view, int64_t element, int kind, int64_t low,
                                 int64_t high, int *ended) {
    int64_t value = read_slot(host, view, element, kind, ended).i;
    if (value >= low && value <= high) return value;
    *ended = AUTOMAX_BROKEN_OFF;
    return 0;
}

static inline double read_real(automax_host *host, int64_t view, int64_t element, int kind, int *ended) {
    return read_slot(host, view, element, kind, ended).d;
}

static inline void write_whole(automax_host *host, int64_t view, int64_t element, int kind, int64_t value,
                               int *ended) {
    automax_slot slot = {.i = value};
    if (*ended == 0 && host->write(host, view, element, kind, slot)) *ended = AUTOMAX_BROKEN_OFF;
}

static inline void write_real(automax_host *host, int64_t view, int64_t element, int kind, double value, int *ended) {
    automax_slot slot = {.d = value};
    if (*ended == 0 && host->write(host, view, element, kind, slot)) *ended = AUTOMAX_BROKEN_OFF;
}

static inline void log_error(automax_host *host, int64_t line, int64_t code, int *ended) {
    if (*ended == 0 && host->log(host, line, code)) *ended = AUTOMAX_BROKEN_OFF;
}

static inline bool errors_logged(automax_host *host, int *ended) {
    int64_t logged = 0;
    if (*ended == 0 && host->errors_logged(host, &logged)) *ended = AUTOMAX_BROKEN_OFF;
    return logged != 0;
}

static inline void clear_errors(automax_host *host, int *ended) {
    if (*ended == 0 && host->clear_errors(host)) *ended = AUTOMAX_BROKEN_OFF;
}

static inline int64_t io_read(automax_host *host, int64_t slot, int64_t place, int64_t *problem, int *ended) {
    int64_t word = 0;
    *problem = 0;
    if (*ended == 0 && host->io_read(host, slot, place, &word, problem)) *ended = AUTOMAX_BROKEN_OFF;
    return word;
}

static inline int64_t io_write(automax_host *host, int64_t slot, int64_t place, int64_t value, int *ended) {
    int64_t problem = 0;
    if (*ended == 0 && host->io_write(host, slot, place, value, &problem)) *ended = AUTOMAX_BROKEN_OFF;
    return problem;
}
