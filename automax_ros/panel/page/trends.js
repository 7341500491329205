// Trends: curves over time in lanes, logic traces, two cursors; live they follow until one zooms.
import { button, el, write } from "./dom.js";
import { app } from "./app.js";
import { say } from "./operate.js";
import { NS, Samples } from "./samples.js";
import uPlot from "./vendor/uplot/uPlot.esm.js";

const MOST_NAMES = 32; // as many as `history` answers
const MOST_POINTS = 20_000; // that it answers
const WINDOWS = { 10: "10 s", 30: "30 s", 60: "1 min", 300: "5 min", 1200: "20 min", 3600: "1 h" };
const [LANE_PX, TALLEST_PX] = [90, 360]; // of a lane
const [TRACE_PX, TIMES_PX] = [26, 26]; // of a logic trace, of the times below all
const SHORTEST_S = 0.002;
const MOST_MS = 3; // of drawing in one frame
const LOOKS = { "+": [0.5, 0], "=": [0.5, 0], "-": [2, 0], ArrowLeft: [1, -0.1], ArrowRight: [1, 0.1] }; // by key
const HELP =
  "Click: cursor A, then B. Drag or wheel: zoom. Shift and wheel: move. Keys: + - 0 (follow), arrows, " +
  "a and b for the cursors at the pointer. Values are those of the last sample before.";

const stepped = uPlot.paths.stepped({ align: 1 });
const live = new Samples(); // grows while another view is shown, too
const list = el("datalist", { id: "trend-names" });
const input = el("input", { list: "trend-names", placeholder: "Add a variable", "aria-label": "Add", onchange: add });
const length = el("select", { title: "Time shown while it follows", onchange: () => setWindow(length.value) });
const follow = button("Follow", "Show the newest values, or all of a recording (0)", () => setRange(null));
const told = el("span", { class: "trend-time" });
const holder = el("div", { class: "lanes", tabindex: 0, role: "group", "aria-label": "Curves", onkeydown });

let samples = live; // what is drawn: these, or a piece of a recording's history
let lanes = []; // {names, logic, rows, plot, chart, lines, drawnTo: time to which its curves are drawn, s}
let range = null; // [from, to] in s where one has zoomed; null follows, or shows all of a recording
let window_s = 60;
let marks = {}; // the cursors A and B: {time, samples}
let pointed = null; // time at the pointer, s
let asked = ""; // the history that was asked for last
let asking = false;
let greeted = null; // the hello for which the names are
let shown = false;

const isRecording = () => app.hello?.kind === "recording";
const isBoolean = (name) => app.entry(name)?.type === "boolean";
const allNames = () => lanes.flatMap(({ names }) => names);
const newLane = (names) => ({ names, logic: names.every(isBoolean) });
const baseOf = ({ names }, k) => names.length - 1 - k + 0.15; // of a logic trace, in traces

function visible() {
  const { span } = app.hello ?? {};
  const now = (app.t ?? 0) / NS;
  const all = span && [span.from_ns / NS, Math.max(span.to_ns, span.from_ns + 1) / NS];
  return range ?? all ?? [Math.max(0, now - window_s), now || window_s];
}

function create() {
  length.append(...Object.entries(WINDOWS).map(([value, text]) => el("option", { value }, text)));
  const acts = [
    button("−", "Show more time (-)", () => look(2, 0)),
    button("+", "Show less time (+)", () => look(0.5, 0)),
    button("‹", "Earlier (left arrow)", () => look(1, -0.5)),
    button("›", "Later (right arrow)", () => look(1, 0.5)),
    button("No cursors", "Take the cursors A and B away", () => ((marks = {}), place())),
    button("CSV", "Save what is shown as a file", () => saveCsv().catch(({ message }) => say(message))),
  ];
  app.on("frame", () => isRecording() || live.add(app.t, app.value));
  app.on("connection", ({ connected }) => connected || live.add((app.t ?? 0) + 1, () => null)); // a gap
  new ResizeObserver(() => shown && build()).observe(holder);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => shown && build());
  const bar = el("div", { class: "view-bar" }, input, list, length, follow, acts, told);
  return el("section", { class: "view-trends" }, bar, holder, el("p", { class: "hint" }, HELP));
}

// The address has lanes separated by ";", names by ","; elements of tables have commas of their own.
function show({ names, window }) {
  shown = true;
  if (!app.hello) return;
  if (greeted !== app.hello) greet();
  if (names) lanes = names.split(";").map((lane) => newLane(lane.split(/,(?![^(]*\))/)));
  else if (!lanes.length) {
    const [logic, numbers] = [true, false].map((kind) => app.hello.watch.filter((name) => isBoolean(name) === kind));
    lanes = [...numbers.map((name) => [name]), logic].filter((each) => each.length).map(newLane);
  }
  if (window in WINDOWS) window_s = Number(window);
  length.value = window_s;
  build();
}

function greet() {
  [greeted, range, marks] = [app.hello, null, {}];
  samples = isRecording() ? new Samples(1) : live;
  const plain = [...app.names.values()].filter(({ type, dims }) => type !== "string" && !dims.length);
  const known = [...plain, ...app.signals()];
  list.replaceChildren(...known.map(({ name }) => el("option", { value: name })));
  length.hidden = isRecording();
  write(follow, isRecording() ? "All" : "Follow");
}

function add() {
  const given = input.value.trim();
  const name = [given, given.toUpperCase()].find((each) => app.entry(each));
  if (!given || allNames().includes(name)) return;
  if (!name) return say(`There is no ${given} here.`);
  if (allNames().length === MOST_NAMES) return say(`At most ${MOST_NAMES} variables are shown.`);
  input.value = "";
  const logic = isBoolean(name) && lanes.find((lane) => lane.logic);
  if (logic) logic.names.push(name);
  else lanes.push(newLane([name]));
  changed();
}

// Takes a name out of its lane: into the lane above (-1), into one of its own (1), or away (0).
function move(lane, name, where) {
  const at = lanes.indexOf(lane);
  lane.names = lane.names.filter((other) => other !== name);
  if (where < 0 && at > 0) lanes[at - 1].names.push(name);
  else if (where) lanes.splice(where > 0 ? at + 1 : 0, 0, newLane([name]));
  changed();
}

function setWindow(seconds) {
  [window_s, range] = [Number(seconds), null];
  changed();
}

function changed() {
  for (const { chart } of lanes) chart?.destroy();
  lanes = lanes.filter(({ names }) => names.length).map(({ names }) => newLane(names));
  app.keep("trends", { names: lanes.map(({ names }) => names.join(",")).join(";"), window: window_s });
  build();
}

function build() {
  for (const { chart } of lanes) chart?.destroy();
  const names = allNames();
  live.keep(names);
  app.want("trends", names);
  const parts = lanes.map((lane) => {
    lane.rows = lane.names.map((name) => newRow(lane, name, (names.indexOf(name) % 8) + 1));
    lane.plot = el("div", { class: "plot" });
    return el("div", { class: "lane" }, el("table", {}, el("tbody", {}, lane.rows.map(({ node }) => node))), lane.plot);
  });
  holder.replaceChildren(...parts);
  const logicPx = ({ logic, names: { length: count } }) => (logic ? count * TRACE_PX + 16 : 0);
  const rest = holder.clientHeight - TIMES_PX - lanes.reduce((sum, lane) => sum + logicPx(lane) + 1, 0);
  const each = Math.floor(Math.min(Math.max(rest / lanes.filter(({ logic }) => !logic).length, LANE_PX), TALLEST_PX));
  for (const lane of lanes) lane.chart = newChart(lane, logicPx(lane) || each);
  asked = "";
  redraw();
}

function newRow(lane, name, trace) {
  const cells = ["now", "A", "B", "difference"].map((kind) => el("td", { class: kind }));
  const swatch = el("i", { class: `swatch trace-${trace}` });
  const { unit = "", text } = app.entry(name) ?? {};
  const head = el("th", { scope: "row", title: text || name }, swatch, name, el("small", {}, ` ${unit}`));
  const ways = { "↑": ["into the lane above", -1], "↓": ["into a lane of its own", 1], "×": ["away", 0] };
  const act = ([text, [says, way]]) => button(text, `${name}: ${says}`, () => move(lane, name, way));
  const acts = el("td", { class: "lane-acts" }, Object.entries(ways).map(act));
  return { name, cells, swatch, node: el("tr", {}, head, cells, acts) };
}

function newChart(lane, height) {
  const { logic, names, rows, plot } = lane;
  const isLast = lane === lanes.at(-1);
  const ink = getComputedStyle(plot);
  const grid = { stroke: ink.outlineColor, width: 1 };
  const axis = { stroke: ink.color, font: `11px ${ink.fontFamily}`, grid, ticks: grid };
  const series = rows.map(({ swatch }, k) => {
    const stroke = getComputedStyle(swatch).color;
    const fill = logic && { fill: stroke.replace("rgb(", "rgba(").replace(")", ", 0.25)"), fillTo: baseOf(lane, k) };
    return { stroke, width: 1.5, paths: stepped, points: { show: false }, ...fill };
  });
  const options = {
    width: plot.clientWidth || 300,
    height: height + (isLast ? TIMES_PX : 0),
    padding: [8, 16, isLast ? 0 : 8, 0],
    legend: { show: false },
    cursor: { sync: { key: "trends" }, points: { show: false }, y: false, drag: { x: true, setScale: false } },
    scales: { x: { time: false, range: visible }, y: logic ? { range: [0, names.length] } : {} },
    axes: [
      { ...axis, show: isLast, size: TIMES_PX, values: (_, splits) => splits.map((time) => `${+time.toFixed(6)} s`) },
      { ...axis, size: 58, values: (_, splits) => splits.map((value) => (logic ? "" : +value.toPrecision(9))) },
    ],
    series: [{}, ...series],
    hooks: { setCursor: [point], setSelect: [select] },
  };
  const chart = new uPlot(options, [[], ...names.map(() => [])], plot);
  chart.over.addEventListener("click", () => pointed !== null && mark(marks.A && !marks.B ? "B" : "A"));
  chart.over.addEventListener("wheel", (event) => wheel(event, chart));
  lane.lines = Object.fromEntries(["A", "B", "at"].map((kind) => [kind, el("div", { class: `mark mark-${kind}` })]));
  chart.over.append(...Object.values(lane.lines));
  return chart;
}

// Draws what has changed: a lane that would move by less than half a pixel stays, what takes long waits for a frame.
function update() {
  if (!shown || !lanes.length || greeted !== app.hello) return;
  const [from, to] = visible();
  const width = Math.ceil(lanes[0].chart.over.clientWidth) || 300;
  if (isRecording()) fetchHistory(from, to, width);
  const end = isRecording() ? Math.min(to, app.hello.span.to_ns / NS) : Math.min(to, samples.last || to);
  const start = performance.now();
  for (const lane of lanes.filter(({ drawnTo }) => !(Math.abs(end - drawnTo) < (to - from) / width / 2))) {
    if (performance.now() - start > MOST_MS) return requestAnimationFrame(update);
    lane.drawnTo = end;
    const columns = samples.columns(lane.names, from, end, width);
    const raise = (k) => (value) => (value === null ? null : baseOf(lane, k) + 0.7 * value);
    const drawn = (k) => (lane.logic ? raise(k) : (value) => app.inUnit(lane.names[k], value));
    lane.chart.setData(columns.map((column, k) => (k ? column.map(drawn(k - 1)) : column)));
  }
  place();
}

async function history(from, to, points) {
  const fields = { names: allNames(), from_ns: Math.floor(from * NS), to_ns: Math.ceil(to * NS), points };
  return Samples.of(fields.names, await app.request("history", fields));
}

async function fetchHistory(from, to, width) {
  const wanted = `${from} ${to} ${width}`;
  if (asking || asked === wanted) return;
  [asked, asking] = [wanted, true];
  try {
    samples = await history(from, to, Math.min(2 * width, MOST_POINTS));
  } catch ({ message }) {
    say(message);
  }
  asking = false;
  redraw();
}

function redraw() {
  for (const lane of lanes) lane.drawnTo = NaN;
  requestAnimationFrame(update);
}

function setRange(wanted) {
  range = wanted;
  redraw();
}

// Shows a span of `factor` times the length, moved by a part of it; `centre` stays in its place.
function look(factor, part, centre) {
  const [from, to] = visible();
  const still = centre ?? (range || isRecording() ? (from + to) / 2 : to);
  const span = Math.max(factor * (to - from), SHORTEST_S);
  const start = still - ((still - from) / (to - from)) * span + part * span;
  setRange([start, start + span]);
}

function wheel(event, chart) {
  event.preventDefault();
  if (event.shiftKey) look(1, (event.deltaY + event.deltaX) / 1000);
  else look(2 ** (event.deltaY / 250), 0, chart.posToVal(event.offsetX, "x"));
}

function select(chart) {
  const { left, width } = chart.select;
  if (width > 3) setRange([chart.posToVal(left, "x"), chart.posToVal(left + width, "x")]);
  chart.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
}

function point(chart) {
  pointed = chart.cursor.left >= 0 ? chart.posToVal(chart.cursor.left, "x") : null;
  requestAnimationFrame(readOut);
}

// Sets a cursor. A recording is asked for the exact values there: the curves are thinned.
async function mark(kind) {
  const set = { time: pointed, samples: null };
  marks[kind] = set;
  place();
  if (isRecording()) set.samples = await history(set.time, set.time, 1).catch(() => null);
  readOut();
}

function place() {
  const isMarked = Boolean(marks.A || marks.B);
  if (holder.classList.contains("marked") !== isMarked) requestAnimationFrame(build); // makes room for their columns
  holder.classList.toggle("marked", isMarked);
  const at = { A: marks.A?.time, B: marks.B?.time, at: isRecording() ? app.at?.t / NS : NaN };
  const [from, to] = visible();
  for (const { chart, lines } of lanes) {
    for (const [kind, line] of Object.entries(lines)) {
      line.hidden = !(at[kind] >= from && at[kind] <= to);
      if (!line.hidden) line.style.left = `${chart.valToPos(at[kind], "x")}px`;
    }
  }
  readOut();
}

function readOut() {
  const { A, B } = marks;
  const now = pointed ?? (isRecording() ? app.at?.t / NS : samples.last);
  const at = (name, set) => (set ? (set.samples ?? samples).valueAt(name, set.time) : NaN);
  for (const { name, cells } of lanes.flatMap(({ rows }) => rows)) {
    const values = [samples.valueAt(name, now), at(name, A), at(name, B)];
    values.forEach((value, k) => {
      const { raw, scaled, shown: whole } = app.format(name, isBoolean(name) ? value > 0 : value);
      write(cells[k], Number.isNaN(value) ? "" : scaled ? `${raw} = ${whole}` : raw);
    });
    const difference = app.inUnit(name, values[2]) - app.inUnit(name, values[1]);
    write(cells[3], Number.isNaN(difference) || isBoolean(name) ? "" : `Δ ${+difference.toPrecision(6)}`);
  }
  follow.setAttribute("aria-pressed", range === null);
  const clock = (time) => app.clock(Math.round(time * NS));
  const texts = [Number.isFinite(now) && clock(now), A && `A ${clock(A.time)}`, B && `B ${clock(B.time)}`];
  if (A && B) texts.push(`Δ ${(B.time - A.time).toFixed(3)} s`);
  write(told, texts.filter(Boolean).join("   "));
}

function onkeydown(event) {
  const { key } = event;
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (key in LOOKS) look(...LOOKS[key]);
  else if (key === "0") setRange(null);
  else if ((key === "a" || key === "b") && pointed !== null) mark(key.toUpperCase());
  else return;
  event.preventDefault();
}

async function saveCsv() {
  const [from, to] = visible();
  const names = allNames();
  const all = isRecording() ? await history(from, to, MOST_POINTS) : live;
  const lines = [["time_s", ...names].map((name) => `"${name.replaceAll('"', '""')}"`).join(",")];
  for (const [time, ...values] of all.rows(names, from, to)) {
    lines.push([time.toFixed(6), ...values.map((value) => (Number.isNaN(value) ? "" : value))].join(","));
  }
  const href = URL.createObjectURL(new Blob([lines.join("\r\n"), "\r\n"], { type: "text/csv" }));
  el("a", { href, download: `${app.hello.rack}.csv` }).click();
  setTimeout(() => URL.revokeObjectURL(href), 10_000);
}

export const view = { name: "trends", title: "Trends", create, show, hide: () => (shown = false), update };
