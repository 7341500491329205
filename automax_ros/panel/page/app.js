// The connection to the program, and the store of what it sent. Views read `app` and listen to its events.
import { el } from "./dom.js";

const MOST_WATCHED = 1000; // names that the program takes at once
const MOST_LOG = 5000; // entries that are kept
const WAITS_MS = [500, 1000, 2000, 4000, 8000]; // before the next attempt to connect
const GATHER_MS = 30; // changes of what is watched are sent together

const listeners = new Map(); // event: functions
const wanted = new Map(); // owner: names
const values = new Map(); // name: value, of watched names
const pending = new Map(); // id of a request: {resolve, reject}
let list = { gen: 0, names: [] }; // what the program watches
let asked = null; // the names that it was asked to watch last
let valuesOf = 0; // number of the list that the values are of
let forced = new Set();
let signals = new Map(); // of plants and webs
let socket = null;
let lastId = 0;
let attempt = 0;
let gathering = 0;

export const app = {
  hello: null,
  status: {},
  log: [],
  t: undefined, // rack time in ns
  at: null, // of a recording: {t, rate, following}
  connected: false,
  heard: 0, // when the program last sent something, ms of performance.now()
  /** @type {Map<string, object>} entries of hello by name, without subscripts */
  names: new Map(),

  on: (event, act) => listeners.set(event, [...(listeners.get(event) ?? []), act]),

  /** Watches the names for this owner, in place of those before. The first 1000 names of all owners are watched. */
  want(owner, names) {
    wanted.set(owner, names);
    clearTimeout(gathering);
    gathering = setTimeout(watch, GATHER_MS);
  },

  /** The value of a watched name; null where it is not known. */
  value: (name) => values.get(name) ?? null,
  isForced: (name) => forced.has(name),
  isTask: (name) => app.hello.tasks.some((task) => task.name === name),
  /** What is known of a variable, an element of an array, or a plant's signal. */
  signals: () => [...signals.values()],
  entry: (name) => app.names.get(name) ?? app.names.get(name.replace(/\(.*/, "")) ?? signals.get(name),

  /** A value in words: as memory has it, by its scale ("" without one), and the one to read, with its unit. */
  format(name, value) {
    const { scale = null, unit = "" } = app.entry(name) ?? {};
    const isNumber = typeof value === "number";
    const raw = isNumber ? String(Number.isInteger(value) ? value : Number(value.toPrecision(6))) : textOf(value);
    const scaled = isNumber && scale ? String(Number(byScale(value, scale).toPrecision(5))) : "";
    return { raw, scaled, shown: isNumber && unit ? `${scaled || raw} ${unit}` : scaled || raw };
  },

  /** A number in the variable's unit: by its scale, or as it is. */
  inUnit(name, value) {
    const scale = app.entry(name)?.scale;
    return scale && value !== null ? byScale(value, scale) : value;
  },

  /** Sends a request; the promise is rejected with the program's reason, or when the connection is lost. */
  request(what, fields = {}) {
    if (!app.connected) return Promise.reject(new Error("The connection is lost; nothing was sent."));
    socket.send(JSON.stringify({ ...fields, id: ++lastId, do: what }));
    return new Promise((resolve, reject) => pending.set(lastId, { resolve, reject }));
  },

  operate: null, // (verb, fields): asks, and operates the rack; operate.js puts its dialogs here
  edit: null, // (name): asks for another value of a variable

  address(view, params = {}) {
    const text = new URLSearchParams(Object.entries(params).filter(([, value]) => value)).toString();
    return `#${view}${text ? `?${text.replaceAll("%2C", ",")}` : ""}`;
  },

  /** Goes to a view by the page's address; `keep` changes the address alone, quietly. */
  go: (view, params) => (location.hash = app.address(view, params)),
  keep: (view, params) => history.replaceState(null, "", app.address(view, params)),
  link: (text, view, params, more) => el("a", { href: app.address(view, params), ...more }, text),

  /** Rack time in words: 12.345 s, or 1:02:03.456 from one minute on. */
  clock(ns, digits = 3) {
    if (ns === null || ns === undefined) return "–";
    const seconds = Math.floor(ns / 10 ** (9 - digits)) / 10 ** digits;
    if (seconds < 60) return `${seconds.toFixed(digits)} s`;
    const minutes = String(Math.floor(seconds / 60) % 60).padStart(2, "0");
    return `${Math.floor(seconds / 3600)}:${minutes}:${(seconds % 60).toFixed(digits).padStart(3 + digits, "0")}`;
  },
};

const textOf = (value) => (typeof value === "boolean" ? String(value).toUpperCase() : String(value ?? "–"));

const tell = (event, facts) => listeners.get(event)?.forEach((act) => act(facts));

function byScale(value, { counts: [low, high], value: [from, to] }) {
  return from + ((value - low) * (to - from)) / (high - low);
}

/** Opens the connection, and again whenever it is lost. Requests that were not answered are not sent again. */
export function connect() {
  socket = new WebSocket(new URL("socket", location.href.split("#")[0].replace(/^http/, "ws")));
  socket.addEventListener("message", ({ data }) => {
    const { id, ok, error, ...news } = JSON.parse(data);
    app.heard = performance.now();
    if (id !== undefined) settle(id, ok, error);
    for (const [kind, facts] of Object.entries(news)) take[kind]?.(facts);
  });
  socket.addEventListener("close", () => {
    app.connected = false;
    const error = { message: "The connection was lost before the answer came." };
    for (const id of [...pending.keys()]) settle(id, null, error);
    const wait = WAITS_MS[Math.min(attempt++, WAITS_MS.length - 1)];
    tell("connection", { attempt, wait });
    setTimeout(connect, wait);
  });
}

function settle(id, ok, error) {
  const { resolve, reject } = pending.get(id) ?? {};
  pending.delete(id);
  if (error) reject?.(new Error([error.message, error.hint].filter(Boolean).join(": ")));
  else resolve?.(ok);
}

const take = {
  hello(hello) {
    Object.assign(app, { hello, status: {}, log: [], t: undefined, at: null, connected: true });
    app.names = new Map(hello.names.map((entry) => [entry.name, entry]));
    const about = { type: "double", dims: [], place: "", isSignal: true };
    const of = (what) => (owner) => owner.signals.map((each) => [
      each.name,
      { ...about, ...each, text: `signal of the ${what}`, writers: [owner.name] },
    ]);
    signals = new Map([...hello.plants.flatMap(of("plant")), ...hello.webs.flatMap(of("web"))]);
    [attempt, list, asked, valuesOf, forced] = [0, { gen: 0, names: [] }, null, 0, new Set()];
    values.clear();
    tell("connection", { attempt });
    tell("hello");
    watch();
  },
  frame({ gen, t, v }) {
    if (gen !== list.gen) return;
    if (gen !== valuesOf) values.clear();
    [valuesOf, app.t] = [gen, t];
    for (const [place, value] of v) values.set(list.names[place], value);
    tell("frame");
  },
  status(news) {
    Object.assign(app.status, news);
    if (news.forced) forced = new Set(news.forced.map(({ name }) => name));
    tell("status");
  },
  log(entries) {
    app.log = [...app.log, ...entries].slice(-MOST_LOG);
    tell("log");
  },
  at(at) {
    Object.assign(app, { at, t: at.t });
    tell("at");
  },
};

async function watch() {
  const names = [...new Set([...wanted.values()].flat())].slice(0, MOST_WATCHED);
  if (!app.connected || names.join("\n") === asked) return;
  asked = names.join("\n");
  const answer = await app.request("watch", { names }).catch(() => (asked = null));
  if (answer) list = { gen: answer.gen, names }; // its first frame comes after the answer
}
