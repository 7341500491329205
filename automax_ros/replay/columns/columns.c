/* What a replay by columns does for each message and each scan. The bytes of chunks are anybody's. */
#include <stdint.h>
#include <string.h>

enum { SCHEMA = 3, CHANNEL = 4, MESSAGE = 5, RECORD_HEAD = 9, MESSAGE_HEAD = 31, MOST_FIELDS = 32 };

/* Finds the records of chunks that follow each other, each up to one of the `ends`. Of each message it sets channel, place, bytes of the message itself, log time and time
 * of sending, in `columns` with room for `room` of them, and the places of definitions. Returns how many messages there
 * are, -1 where other records stand among them, one is cut off, or there is no room for all of them. */
int64_t automax_records(
    const uint8_t *data, const int64_t *ends, int64_t chunks, int64_t room, int64_t *columns, int64_t definition_room,
    int64_t *definitions, int64_t *defined
) {
    int64_t found = 0, chunk = 0;
    *defined = 0;
    for (int64_t place = 0; chunk < chunks;) {
        uint64_t length;
        int64_t size = ends[chunk];
        if (place == size) {
            chunk++;
            continue;
        }
        uint16_t channel;
        if (size - place < RECORD_HEAD) return -1;
        memcpy(&length, data + place + 1, sizeof length);
        if (length > (uint64_t)(size - place - RECORD_HEAD)) return -1;
        if (data[place] == MESSAGE) {
            if (length < MESSAGE_HEAD - RECORD_HEAD || found == room) return -1;
            memcpy(&channel, data + place + 9, sizeof channel);
            columns[found] = channel;
            columns[room + found] = place;
            columns[2 * room + found] = (int64_t)length - (MESSAGE_HEAD - RECORD_HEAD);
            memcpy(columns + 3 * room + found, data + place + 15, 8);
            memcpy(columns + 4 * room + found, data + place + 23, 8);
            found++;
        } else if (data[place] == SCHEMA || data[place] == CHANNEL) {
            if (*defined == definition_room) return -1;
            definitions[(*defined)++] = place;
        } else {
            return -1;
        }
        place += RECORD_HEAD + (int64_t)length;
    }
    return found;
}

/* What is taken of the messages of a type: how their fields are found (messages/cdr/fields.h), which `numbers` are wanted,
 * the first lists of values of variables (`groups`: numbers, elements, values), and the lists of pairs of uint16 and of
 * the text by which messages are told apart (-1: none). */
typedef int automax_find(const uint8_t *message, int64_t length, int64_t *numbers, int64_t *places, int64_t *counts);
typedef struct {
    automax_find *find;
    int64_t numbers, groups;
    const int64_t *number, *group;
    int64_t pairs, text;
} automax_kind;

/* Texts, one after the other, each up to its `ends`. */
typedef struct {
    const uint8_t *letters;
    const int64_t *ends;
    int64_t count;
} automax_texts;

/* What the variables of a rack can hold, by their numbers. */
typedef struct {
    int64_t count;
    const int64_t *elements;
    const double *least, *greatest;
    const uint8_t *real;
} automax_rules;

/* A value of a variable, or a pair of numbers. */
typedef struct {
    double value;
    uint32_t element;
    uint16_t view;
} automax_entry;

static int64_t number_of(const automax_texts *texts, const uint8_t *text, int64_t length) {
    int64_t begin = 0;
    for (int64_t number = 0; number < texts->count; begin = texts->ends[number++])
        if (texts->ends[number] - begin == length && !memcmp(texts->letters + begin, text, (size_t)length))
            return number;
    return -1;
}

static int is_fit(const automax_rules *rules, const automax_entry *entry) {
    int64_t view = entry->view;
    double value = entry->value;
    return view < rules->count && entry->element < rules->elements[view] && rules->least[view] <= value &&
           value <= rules->greatest[view] && (rules->real[view] || value == (double)(int64_t)value);
}

/* Copies values of variables; whole numbers have no negative zero. Returns whether each is one that can be. */
static int copied(
    const uint8_t *message, const int64_t *places, int64_t count, const automax_rules *rules, automax_entry *entries
) {
    int fit = 1;
    for (int64_t k = 0; k < count; k++) {
        memcpy(&entries[k].view, message + places[0] + k * 2, 2);
        memcpy(&entries[k].element, message + places[1] + k * 4, 4);
        memcpy(&entries[k].value, message + places[2] + k * 8, 8);
        if (!is_fit(rules, &entries[k]))
            fit = 0;
        else if (!rules->real[entries[k].view])
            entries[k].value += 0.0;
    }
    return fit;
}

static void copy_pairs(const uint8_t *pairs, int64_t count, automax_entry *entries) {
    for (int64_t k = 0; k < count; k++) {
        uint16_t pair[2];
        memcpy(pair, pairs + 4 * k, sizeof pair);
        entries[k] = (automax_entry){0.0, pair[1], pair[0]};
    }
}

/* Takes messages of a kind, at `starts` in `size` bytes of `data`. For each it sets `fits`, whether it is `odd` (its
 * lists have different lengths, or values that their variables cannot have), the wanted `numbers` (a column each), what
 * its text is among the `texts` (-1: none of them), where its entries begin, and how many each of its lists has: the
 * groups, then the pairs. Returns whether the `room` for entries was enough. */
int64_t automax_take(
    const automax_kind *kind, const automax_texts *texts, const automax_rules *rules, const uint8_t *data, int64_t size,
    const int64_t *starts, const int64_t *lengths, int64_t count, int64_t room, uint8_t *fits, uint8_t *odd,
    int64_t *numbers, int64_t *named, int64_t *begins, int64_t *counts, automax_entry *entries
) {
    int64_t found[MOST_FIELDS] = {0}, places[MOST_FIELDS] = {0}, items[MOST_FIELDS] = {0}, used = 0;
    for (int64_t row = 0; row < count; row++, counts += kind->groups + 1) {
        int64_t start = starts[row], length = lengths[row];
        int within = start >= 0 && start <= size && length >= 0 && length <= size - start;
        const uint8_t *message = data + (within ? start : 0);
        begins[row] = used;
        named[row] = -1;
        fits[row] = within ? (uint8_t)kind->find(message, length, found, places, items) : 0;
        odd[row] = !fits[row];
        for (int64_t number = 0; number < kind->numbers; number++)
            numbers[number * count + row] = found[kind->number[number]];
        memset(counts, 0, (size_t)(kind->groups + 1) * sizeof *counts);
        if (!fits[row]) continue;
        if (kind->text >= 0) named[row] = number_of(texts, message + places[kind->text], items[kind->text]);
        for (int64_t group = 0; group < kind->groups; group++) {
            const int64_t *place = places + kind->group[group], *its = items + kind->group[group];
            if (its[0] != its[1] || its[0] != its[2]) {
                odd[row] = 1;
                continue;
            }
            if (its[0] > room - used) return 0;
            odd[row] |= !copied(message, place, its[0], rules, entries + used);
            used += counts[group] = its[0];
        }
        if (kind->pairs < 0) continue;
        if (items[kind->pairs] > room - used) return 0;
        copy_pairs(message + places[kind->pairs], items[kind->pairs], entries + used);
        used += counts[kind->groups] = items[kind->pairs];
    }
    return 1;
}

/* Sets for some messages the offsets of the entries of each of their `lists`: a row of count + 1 for each. */
void automax_offsets(int64_t lists, const int64_t *rows, int64_t count, const int64_t *counts, int64_t *offsets) {
    for (int64_t list = 0; list < lists; list++, offsets += count + 1) {
        offsets[0] = 0;
        for (int64_t k = 0; k < count; k++) offsets[k + 1] = offsets[k] + counts[rows[k] * lists + list];
    }
}

/* Copies the entries of some messages, those of each of their `lists` into columns of its own. */
void automax_pick(
    int64_t lists, const int64_t *rows, int64_t count, const int64_t *counts, const int64_t *begins,
    const automax_entry *entries, int64_t *const *views, int64_t *const *elements, double *const *values
) {
    int64_t places[MOST_FIELDS] = {0};
    for (int64_t k = 0; k < count; k++) {
        const automax_entry *entry = entries + begins[rows[k]];
        for (int64_t list = 0; list < lists; list++)
            for (int64_t number = counts[rows[k] * lists + list]; number > 0; number--, entry++) {
                int64_t place = places[list]++;
                views[list][place] = entry->view;
                elements[list][place] = entry->element;
                values[list][place] = entry->value;
            }
    }
}

/* Fills columns, one for each of `width` positions, with what each scan has latched: a value holds until the next one.
 * `positions` are those of the `known` views, -1 for others; `now` holds the values before the first scan, and then the last. */
void automax_latched(
    int64_t count, const int64_t *offsets, const int64_t *views, const double *values, const int64_t *positions,
    int64_t known, int64_t width, int64_t *now, int64_t *since, int64_t *columns
) {
    for (int64_t position = 0; position < width; position++) since[position] = 0;
    for (int64_t scan = 0; scan < count; scan++)
        for (int64_t entry = offsets[scan]; entry < offsets[scan + 1]; entry++) {
            int64_t position = views[entry] < known ? positions[views[entry]] : -1;
            if (position < 0) continue;
            int64_t *column = columns + position * count;
            for (int64_t k = since[position]; k < scan; k++) column[k] = now[position];
            since[position] = scan;
            now[position] = (int64_t)values[entry];
        }
    for (int64_t position = 0; position < width; position++)
        for (int64_t k = since[position]; k < count; k++) columns[position * count + k] = now[position];
}

/* Returns the first scan whose commit is not the recorded one: the `outputs` (a column for each of `width` variables)
 * that differ from what was `latched`, in their order. */
int64_t automax_same_commits(
    int64_t count, int64_t width, const int64_t *const *outputs, const int64_t *const *latched, const int64_t *views,
    const int64_t *offsets, const int64_t *recorded, const double *values
) {
    for (int64_t scan = 0; scan < count; scan++) {
        int64_t entry = offsets[scan];
        for (int64_t output = 0; output < width; output++) {
            int64_t value = outputs[output][scan];
            if (value == latched[output][scan]) continue;
            if (entry == offsets[scan + 1] || recorded[entry] != views[output] || values[entry] != (double)value)
                return scan;
            entry++;
        }
        if (entry != offsets[scan + 1]) return scan;
    }
    return count;
}
