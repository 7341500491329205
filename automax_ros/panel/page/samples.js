// Samples of many names on one time base, in rings of fixed size; a value holds until the next sample. Times are in s.

export const NS = 1e9;
const HOUR = 72_000; // samples: an hour of 20 frames a second

const asNumber = (value) => (["number", "boolean"].includes(typeof value) ? Number(value) : NaN);

export class Samples {
  constructor(depth = HOUR) {
    // Sample number k stands at k % depth.
    Object.assign(this, { depth, times: new Float64Array(depth), rings: new Map(), count: 0 });
  }

  /** The samples that an answer of `history` means: all times of all names, each value held until its next. */
  static of(names, { t, v }) {
    const times = Float64Array.from(new Set(t.flat())).sort();
    const samples = new Samples(times.length || 1);
    samples.keep(names);
    const next = names.map(() => 0);
    for (const time of times) {
      for (const k of next.keys()) while (next[k] < t[k].length && t[k][next[k]] <= time) next[k]++;
      const values = new Map(names.map((name, k) => [name, v[k][next[k] - 1]]));
      samples.add(time, (name) => values.get(name));
    }
    return samples;
  }

  keep(names) {
    for (const name of this.rings.keys()) if (!names.includes(name)) this.rings.delete(name);
    for (const name of names) if (!this.rings.has(name)) this.rings.set(name, new Float64Array(this.depth).fill(NaN));
  }

  /** Adds a sample of each name. Time that goes backwards is another run, or a recording that was moved. */
  add(ns, valueOf) {
    const time = ns / NS;
    if (time < this.last) this.count = 0;
    if (time !== this.last) this.count++;
    const place = (this.count - 1) % this.depth;
    this.times[place] = time;
    for (const [name, ring] of this.rings) ring[place] = asNumber(valueOf(name));
  }

  get last() {
    return this.count ? this.times[(this.count - 1) % this.depth] : NaN;
  }

  /** The number of the last sample at or before a time; -1 without one. */
  before(time) {
    let [low, high] = [Math.max(0, this.count - this.depth) - 1, this.count];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.times[middle % this.depth] <= time) low = middle;
      else high = middle;
    }
    return low < this.count - this.depth ? -1 : low;
  }

  valueAt(name, time) {
    const k = this.before(time);
    return k < 0 ? NaN : (this.rings.get(name)?.[k % this.depth] ?? NaN);
  }

  /** The samples of a span as rows [time, value of each name]; the first one holds at its start. */
  *rows(names, from, to) {
    const rings = names.map((name) => this.rings.get(name));
    for (let k = Math.max(this.before(from), 0, this.count - this.depth); k <= this.before(to); k++) {
      yield [Math.max(this.times[k % this.depth], from), ...rings.map((ring) => ring[k % this.depth])];
    }
  }

  /**
   * Columns for drawing: times, and values of each name (null: unknown), held until `to`. Of more samples than `width`
   * pixels can show, each pixel keeps the least and the greatest value, in their order.
   */
  columns(names, from, to, width) {
    const [first, end] = [Math.max(this.before(from), 0, this.count - this.depth), this.before(to)];
    const pixel = end - first < 2 * width ? 0 : (to - from) / width;
    const [parts, times] = [[], []];
    for (let k = first, until; k <= end; k = until) {
      const next = pixel && (Math.floor(this.times[k % this.depth] / pixel) + 1) * pixel;
      for (until = k + 1; until <= end && this.times[until % this.depth] < next; ) until++;
      parts.push([k, until]);
      times.push(this.times[k % this.depth]);
      if (until > k + 1) times.push(this.times[((k + until) >> 1) % this.depth]);
    }
    const isHeld = times.at(-1) < to;
    const columns = names.map((name) => this.#column(this.rings.get(name), parts));
    return [times, ...columns].map((column, k) => (isHeld ? [...column, k ? column.at(-1) : to] : column));
  }

  #column(ring, parts) {
    if (!ring) return parts.flatMap(([k, until]) => (until > k + 1 ? [null, null] : [null])); // not here yet
    const values = [];
    for (const [k, until] of parts) {
      let place = k % this.depth;
      let [least, leastAt, most, mostAt] = [ring[place], k, ring[place], k];
      for (let j = k + 1; j < until; j++) {
        if (++place === this.depth) place = 0;
        if (ring[place] < least) [least, leastAt] = [ring[place], j];
        else if (ring[place] > most) [most, mostAt] = [ring[place], j];
      }
      const inOrder = leastAt < mostAt ? [least, most] : [most, least];
      for (const value of inOrder.slice(0, until - k)) values.push(Number.isFinite(value) ? value : null);
    }
    return values;
  }
}
