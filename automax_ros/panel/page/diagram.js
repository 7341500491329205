// The diagram of a task: boxes and wires with values, and next to it the source with the same values.
import { el, svg, write } from "./dom.js";
import { app } from "./app.js";
import { newStage } from "./stage.js";

const NOT_KEPT = "Memory keeps what a later line writes. A recording knows this value too: it executes the scan again.";
const FEEDBACK = "read before it is written: the value of the last scan";

const stage = newStage("Block diagram: arrow keys move it, + - 0 zoom, Tab goes through its blocks");
const tasks = el("nav", { class: "tasks", "aria-label": "Tasks" });
const search = el("input", { type: "search", placeholder: "Block, line, variable", "aria-label": "Find" });
const found = el("span", { class: "hint" });
const scanAt = el("span", { class: "scan-at" });
const why = el("p", { class: "why" });
const told = el("div", { class: "told" });
const source = el("div", { class: "source", tabindex: 0, role: "group", "aria-label": "Source" });
const bar = el("div", { class: "view-bar" }, tasks, search, found, stage.buttons, scanAt);
const over = (event) => light(keyAt(event) || chosen);
const listeners = { onpointerover: over, onfocusin: over, onpointerleave: () => light(chosen), onclick, onkeydown };
const both = el("div", { class: "both", ...listeners }, stage.node, source);
const root = el("section", { class: "view-diagram" }, bar, why, both, told);

let greeted = null; // the hello for which the diagram was asked
let drawn = null; // what is shown: the answer of `diagram`
let wish = ""; // the diagram that was asked for last: an answer that comes late is not drawn
let which = "own"; // whose source: that of the rack or recording, or "other"
let spots = []; // where values stand: {net, node, group, state}
let lights = new Map(); // key of a box, net or name: the elements that light together
let places = new Map(); // key: where it stands in the drawing
let targets = []; // what can be found: {text, key}
let chosen = ""; // the key that was clicked
let hit = -1; // number of the last target that was found
let scan = null; // of a recording: the values of the scan at its position
let scanned = ""; // the scan that was asked for last
let asking = false;
let shown = false;

const isRecording = () => app.hello.kind === "recording";
const keyAt = ({ target }) => target.closest("[data-key]")?.dataset.key ?? "";
const keyOf = (net) => (net.id === null ? `name ${net.name}` : `net ${net.id}`);
const boxOf = (row) => drawn.boxes.find(({ rows: [first, last] }) => first <= row && row <= last);
const rowKey = (row) => (boxOf(row) ? `box ${boxOf(row).id}` : `row ${row}`);

function show(params) {
  shown = true;
  if (!app.hello) return;
  const task = params.task || drawn?.task || app.hello.tasks[0]?.name;
  const wanted = params.which === "other" ? "other" : "own";
  if (!params.task) app.keep("diagram", { ...params, task }); // so that it can be gone back to
  const isDrawn = greeted === app.hello && drawn?.task === task && wish === `${task} ${wanted}`;
  if (isDrawn) point(params);
  else if (task) load(task, wanted, params);
}

async function load(task, wanted, params) {
  const start = performance.now();
  const own = `${task} ${wanted}`;
  [greeted, which, wish] = [app.hello, wanted, own];
  const tab = (text, to, isHere) => app.link(text, "diagram", to, { "aria-current": isHere && "page" });
  const tabs = app.hello.tasks.map(({ name }) => tab(name, { task: name }, name === task && which === "own"));
  if (app.hello.other) tabs.push(tab(app.hello.other.label, { task, which: "other" }, which === "other"));
  tasks.replaceChildren(...tabs);
  try {
    const answer = await app.request("diagram", { task, which });
    if (wish !== own) return;
    draw(answer);
    point(params);
    performance.measure("diagram", { start }); // from the click to the drawing
  } catch ({ message }) {
    if (wish === own) write(why, message);
  }
}

function draw(facts) {
  drawn = facts;
  [spots, targets, lights, places, chosen, scan, scanned] = [[], [], new Map(), new Map(), "", null, ""];
  told.replaceChildren();
  write(why, facts.drawable ? "" : `Not drawn: ${facts.why}. This is the source with its values.`);
  root.classList.toggle("undrawn", !facts.drawable);
  const wires = drawWires();
  const flags = facts.flags.map((flag) => drawFlag(flag, wires));
  const nodes = [...facts.boxes.map(drawBox), ...flags, ...facts.pins.flatMap((pin) => drawPin(pin, wires))];
  stage.show([...[...wires.values()].map(({ group }) => group), ...nodes], facts.width, facts.height);
  source.replaceChildren(...drawSource());
  for (const node of both.querySelectorAll("[data-key]")) {
    lights.set(node.dataset.key, [...(lights.get(node.dataset.key) ?? []), node]);
  }
  scrollTo(source.querySelector("[data-key^=box]"));
  app.want("diagram", [...new Set(spots.map(({ net }) => net.watch))]);
  update();
}

function titleOf(net, isFeedback) {
  const written = net.line ? `${net.name}, written in line ${net.line}` : net.name;
  const lines = [written, app.entry(net.watch)?.text, isFeedback && FEEDBACK, !net.kept && !isRecording() && NOT_KEPT];
  return svg("title", {}, lines.filter(Boolean).join("\n"));
}

function drawWires() {
  const wires = new Map();
  for (const net of drawn.nets) {
    const own = drawn.wires.filter((wire) => wire.net === net.id);
    const line = ({ points }, kind) => svg("polyline", { points: points.join(" "), class: kind });
    const lines = own.map((wire) => [line(wire, "reach"), line(wire, wire.feedback ? "wire feedback" : "wire")]);
    const forks = drawn.forks.filter((fork) => fork.net === net.id);
    lines.push(forks.map(({ x, y }) => svg("circle", { class: "fork", cx: x, cy: y, r: 2.5 })));
    const title = titleOf(net, own.some(({ feedback }) => feedback));
    wires.set(net.id, { net, group: svg("g", { class: "net", "data-key": keyOf(net) }, title, lines) });
    targets.push({ text: net.name, key: keyOf(net) });
  }
  return wires;
}

function drawBox({ id, x, y, w, h, kind, title, line, text }) {
  const [key, middle] = [`box ${id}`, x + w / 2];
  targets.push({ text: `${title} ${line}`, key });
  places.set(key, [middle, y + h / 2]);
  return svg(
    "g",
    { class: `box ${kind}`, tabindex: 0, role: "button", "aria-label": `${title}, line ${line}`, "data-key": key },
    svg("rect", { x, y, width: w, height: h, rx: 3 }),
    svg("text", { class: "box-title", x: middle, y: y + 15 }, title),
    svg("text", { class: "box-line", x: middle, y: y + h - 5 }, line),
    kind === "basic" && text.map((each, k) => svg("text", { x: x + 8, y: y + 30 + 14 * k }, each)),
  );
}

// A common at the edge: it leads to the one task that writes it (or reads it); of several, the line below has links.
function drawFlag({ name, out, x, y, w, h, net }, wires) {
  const { writers = [], readers = [] } = app.entry(name) ?? {};
  const others = out ? readers : writers;
  const none = `no task ${out ? "reads" : "writes"} it`;
  const title = `${name}: ${others.length ? `${out ? "read" : "written"} by ${others.join(", ")}` : none}`;
  const points = [x, y, x + w - 8, y, x + w, y + h / 2, x + w - 8, y + h, x, y + h].join(" ");
  const text = svg("text", { x: x + 6, y: y + h / 2 + 4 }, name);
  const shape = [svg("polygon", { points }), text, svg("title", {}, title)];
  const [first, second] = others.filter((task) => task !== drawn.task);
  const href = app.address("diagram", { task: first, name });
  const linked = first && !second ? svg("a", { href, "aria-label": title }, shape) : shape;
  const group = svg("g", { class: "flag", "data-key": `net ${net}` }, linked);
  if (!out) places.set(`net ${net}`, [x + w / 2, y + h / 2]);
  if (!out) group.append(drawValue(wires.get(net), x + w + 3, y + h / 2 - 4));
  return group;
}

function drawPin({ symbol, name, out, x, y, negated, value, var: variable, net }, wires) {
  const side = out ? { class: "symbol out", x: x - 5 } : { class: "symbol", x: x + 5 };
  const nodes = [svg("text", { ...side, y: y + 4 }, symbol, svg("title", {}, name))];
  if (negated) nodes.push(svg("circle", { class: "bubble", cx: x - 4, cy: y, r: 4 }));
  const given = { class: out ? "given out" : "given", x: out ? x + 4 : x - (negated ? 12 : 4), y: y + 4 };
  if (out && net !== null) {
    const isNamed = drawn.flags.some((flag) => flag.out && flag.net === net); // at its end
    const text = svg("text", { class: "net-name", x: x + 3, y: y - 3, "data-key": `net ${net}` });
    if (!isNamed) text.append(wires.get(net).net.name);
    places.set(`net ${net}`, [x, y]);
    nodes.push(text, drawValue(wires.get(net), x + 3, isNamed ? y - 4 : y + 10));
  } else if (variable) {
    const [own, node] = [bare(variable), svg("tspan", { class: "value" })];
    spots.push({ net: own, node });
    places.set(keyOf(own), [x, y]);
    targets.push({ text: variable, key: keyOf(own) });
    nodes.push(svg("text", { ...given, "data-key": keyOf(own) }, `${variable} `, node, titleOf(own)));
  } else if (value) nodes.push(svg("text", given, value));
  return nodes;
}

function drawValue({ net, group }, x, y) {
  const node = svg("text", { class: "value", x, y, "data-key": keyOf(net) });
  spots.push({ net, node, group });
  return node;
}

// A variable that no net carries: a tunable, or any of a source that is not drawn.
function bare(name, line = 0) {
  const own = `${drawn.task}.${name}`;
  return { id: null, name, watch: app.entry(own) ? own : name, line, kept: true };
}

// What a line means by a name: the net that it writes, else the last one written above it, else that of the last scan.
function netAt(name, line) {
  const nets = drawn.nets.filter((net) => net.name === name).sort((one, two) => two.line - one.line);
  return nets.find((net) => net.line <= line) ?? nets[0] ?? bare(name, line);
}

function drawSource() {
  let line = 0;
  return drawn.source.map(({ row, line: own, text, names }) => {
    line = own || line;
    const nets = new Map(names.map((name) => [name, netAt(name, line)]));
    const values = [...nets].map(([name, net]) => {
      const node = el("span", { class: "value" });
      spots.push({ net, node });
      return el("span", { class: "row-value" }, nets.size > 1 && `${name} `, node);
    });
    const code = el("span", { class: /^\d*\s*REM\b/.test(text) && "rem" }, marked(text, nets));
    return el("div", { class: "row", "data-key": rowKey(row) }, code, values);
  });
}

// The text of a row, its names as elements that light.
function marked(text, nets) {
  const names = [...nets.keys()].sort((one, two) => two.length - one.length);
  const patterns = names.map((name) => name.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
  const pieces = names.length ? text.split(new RegExp(`(?<![A-Z0-9_])(${patterns.join("|")})`)) : [text];
  const span = (name) => el("span", { class: "name", "data-key": keyOf(nets.get(name)) }, name);
  return pieces.map((piece, k) => (k % 2 ? span(piece) : piece));
}

// The value of a net at its line in a scan: line 0 is the scan's start.
function valueIn({ before, after }, { name, line }) {
  let [value, last] = [before[name], 0];
  for (const [at, written] of Object.entries(after)) {
    if (last < at && at <= line && name in written) [value, last] = [written[name], Number(at)];
  }
  return value ?? null;
}

// The value of a net now, or in the scan shown; and that of the scan next to it, where there is one.
function valuesOf(net) {
  const [own, other] = which === "other" ? [scan?.other, scan] : [scan, scan?.other];
  if (own) return [valueIn(own, net), other ? valueIn(other, net) : undefined];
  return [net.kept ? app.value(net.watch) : null, undefined];
}

function update() {
  if (!shown || !drawn || greeted !== app.hello) return;
  if (isRecording()) fetchScan();
  for (const spot of spots) {
    const values = valuesOf(spot.net);
    const state = `${values} ${app.isForced(spot.net.watch)}`;
    if (state !== spot.state) putValue(spot, ...values);
    spot.state = state;
  }
}

function putValue({ net, node, group }, value, other) {
  const text = (each) => (each === null ? "?" : app.format(net.watch, each).raw);
  const span = (...content) => (node instanceof SVGElement ? svg("tspan", ...content) : el("span", ...content));
  const isNext = other !== undefined;
  node.replaceChildren(text(value), isNext ? span({ class: "other" }, ` ${text(other)}`) : "");
  const states = { forced: app.isForced(net.watch), true: value === true, unknown: value === null };
  states.differs = isNext && other !== value;
  for (const each of [node, group]) for (const state in states) each?.classList.toggle(state, states[state]);
}

async function fetchScan() {
  const { task } = drawn;
  const t = app.at?.t ?? app.hello.span.to_ns;
  if (asking || scanned === `${task} ${t}`) return;
  [scanned, asking] = [`${task} ${t}`, true];
  try {
    const answer = await app.request("scan", { task, t });
    if (drawn.task === task) scan = answer;
    const next = which === "other" ? app.hello.rack : app.hello.other?.label;
    scanAt.replaceChildren(`scan ${answer.scan} at ${app.clock(answer.t, 4)}  `);
    if (answer.other) scanAt.append(el("span", { class: "other" }, next));
  } catch ({ message }) {
    scan = null;
    write(scanAt, message);
  }
  asking = false;
  requestAnimationFrame(update);
}

function light(key) {
  for (const node of both.querySelectorAll(".lit")) node.classList.remove("lit");
  for (const node of lights.get(key) ?? []) node.classList.add("lit");
  told.replaceChildren(...about(key));
}

// What is said of a box or a variable below the drawing.
function about(key) {
  const [, kind, id] = key.match(/^(\w+) (.*)$/) ?? [];
  const box = kind === "box" && drawn.boxes.find((each) => String(each.id) === id);
  if (box) return [el("b", {}, box.title), ` line ${box.line}`];
  if (kind !== "net" && kind !== "name") return [];
  const net = kind === "net" ? drawn.nets.find((each) => String(each.id) === id) : bare(id);
  const { text = "", writers = [], readers = [] } = app.entry(net.watch) ?? {};
  const link = (task) => [" ", app.link(task, "diagram", { task, name: net.name })];
  const links = (says, names) => (names.length ? [` ${says}`, ...names.flatMap(link)] : []);
  const value = ` ${app.format(net.watch, valuesOf(net)[0]).shown}${net.line ? `, line ${net.line}` : ""}. ${text}`;
  const uses = [...links("Written by", writers), ...links("Read by", readers), " "];
  return [el("b", {}, net.name), value, ...uses, app.link("Trend", "trends", { names: net.watch })];
}

function scrollTo(row) {
  if (row && !row.matches(":hover")) source.scrollTop = row.offsetTop - source.clientHeight / 3;
}

function choose(key, isCentred) {
  chosen = key;
  light(key);
  if (isCentred && places.has(key)) stage.centre(...places.get(key));
  scrollTo(lights.get(key)?.find((node) => source.contains(node))?.closest(".row"));
}

function onclick(event) {
  if (event.target.closest("a")) return;
  const key = keyAt(event);
  choose(key === chosen ? "" : key, source.contains(event.target));
  const box = drawn.boxes.find(({ id }) => chosen === `box ${id}`);
  app.keep("diagram", { task: drawn.task, which: which === "other" && which, line: box?.line });
}

function onkeydown({ key, target }) {
  if (key === "Escape") choose("", false);
  if (key === "Enter" && target.dataset.key) choose(target.dataset.key, true);
}

// What an address points at: a line of the source, or a variable.
function point({ line, name }) {
  const row = line && drawn.source.find((each) => String(each.line) === line)?.row;
  const net = name && drawn.nets.find((each) => each.name === name);
  if (net) choose(keyOf(net), true);
  else if (row) choose(rowKey(row), true);
}

function find(isNew) {
  const text = search.value.trim().toUpperCase();
  const hits = text ? targets.filter((target) => target.text.includes(text)) : [];
  hit = isNew ? 0 : (hit + 1) % (hits.length || 1);
  write(found, text && (hits.length ? `${hit + 1} of ${hits.length}` : "not found"));
  choose(hits[hit]?.key ?? "", true);
}

search.addEventListener("input", () => find(true));
search.addEventListener("keydown", ({ key }) => key === "Enter" && find(false));

const hide = () => (shown = false);
export const view = { name: "diagram", title: "Diagram", create: () => root, show, hide, update };
