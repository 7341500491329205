// Memory: a table of all names, of which only the visible rows are elements and are watched.
import { button, check, el, table, td, write } from "./dom.js";
import { app } from "./app.js";

const ROW_PX = 28; // as in style.css
const SPARE_ROWS = 6; // above and below what is visible
const MOST_ELEMENTS = 5000; // of one array
const COLUMNS = ["", "Name", "Value", "Scaled", "Unit", "Type", "Written by", "Place", "Description", ""];
const LABEL = "Names: arrows choose, Space watches, Enter changes, right and left open and close an array";

const parts = {};
const open = new Set(); // arrays whose elements are shown
let params = {}; // of the address: q, forced, only, watch
let watched = []; // names
let rows = []; // {name, entry, kind}: kind is "array", "element" or "plain"
let first = -1;
let drawn = []; // of the rows from `first` on: {row, value, scaled, node}
let chosen = 0; // number of the row that the keys act on
let forcedThen = "";

function create() {
  const state = (key) => (on) => restate({ [key]: on ? 1 : "" });
  const oninput = () => restate({ q: parts.search.value });
  const placeholder = "Filter: name, type, writer, words ( / )";
  parts.search = el("input", { type: "search", placeholder, "aria-label": "Filter", oninput });
  parts.forced = check("Forced only", state("forced"));
  parts.only = check("Watch list only", state("only"));
  parts.clear = button("Clear watch list", "", () => restate({ watch: "", only: "" }));
  parts.count = el("span", { class: "hint" });
  [parts.above, parts.rows, parts.below] = ["space", "", "space"].map((kind) => el("tbody", { class: kind }));
  const listens = { onscroll: () => draw(), onkeydown: keyed };
  const frame = { class: "frame fills", tabindex: 0, role: "group", "aria-label": LABEL, ...listens };
  parts.frame = el("div", frame, table("memory-table", COLUMNS, parts.above, parts.rows, parts.below));
  new ResizeObserver(() => draw()).observe(parts.frame);
  app.on("hello", gather);
  const bar = el("div", { class: "view-bar" }, parts.search, parts.forced, parts.only, parts.clear, parts.count);
  return el("section", { class: "view-memory" }, bar, parts.frame);
}

/** Changes parameters of the address, and shows what they select. */
function restate(some) {
  app.keep("memory", { ...params, ...some });
  show({ ...params, ...some });
}

function show(given) {
  params = given;
  watched = (given.watch ?? "").split(/,(?![^(]*\))/).filter(Boolean);
  parts.search.value = given.q ?? "";
  parts.forced.box.checked = Boolean(given.forced);
  parts.only.box.checked = Boolean(given.only);
  parts.clear.hidden = !watched.length;
  gather();
}

/** Selects names by the filter; those of the watch list stand first, whatever the filter says. */
function gather() {
  if (!app.hello) return;
  const all = [...app.names.values(), ...app.signals()];
  const words = (params.q ?? "").toUpperCase().split(/\s+/);
  forcedThen = JSON.stringify(app.status.forced);
  const forced = new Set(app.status.forced?.map(({ name }) => name.replace(/\(.*/, "")));
  const holds = ({ name, type, writers, text, place }) => {
    const said = [name, type, ...writers, text, place].join(" ").toUpperCase();
    return (!params.forced || forced.has(name)) && words.every((word) => said.includes(word));
  };
  const found = params.only ? [] : all.filter((entry) => !watched.includes(entry.name) && holds(entry));
  const top = watched.map((name) => ({ ...app.entry(name), name })).filter(({ type }) => type);
  rows = [...top, ...found].flatMap(withElements);
  write(parts.count, `${top.length + found.length} of ${all.length} names`);
  chosen = Math.max(0, Math.min(chosen, rows.length - 1));
  first = -1;
  draw();
}

function withElements(entry) {
  const { name, dims } = entry;
  if (!dims?.length || name.includes("(")) return [{ name, entry, kind: "plain" }];
  const head = { name, entry, kind: "array" };
  if (!open.has(name)) return [head];
  const longer = (places, most) => places.flatMap((place) => Array.from({ length: most + 1 }, (_, k) => [...place, k]));
  const places = dims.reduce((some, most) => longer(some, most).slice(0, MOST_ELEMENTS), [[]]);
  return [head, ...places.map((place) => ({ name: `${name}(${place.join(",")})`, entry, kind: "element" }))];
}

/** Makes elements of the visible rows, where others than before are visible, and watches these. */
function draw() {
  const { scrollTop, clientHeight } = parts.frame;
  const from = Math.max(0, Math.min(Math.floor(scrollTop / ROW_PX), rows.length) - SPARE_ROWS);
  const to = Math.min(rows.length, Math.ceil((scrollTop + clientHeight) / ROW_PX) + SPARE_ROWS);
  if (from === first && to === first + drawn.length) return;
  first = from;
  drawn = rows.slice(from, to).map(newRow);
  parts.rows.replaceChildren(...drawn.map(({ node }) => node));
  parts.above.style.height = `${from * ROW_PX}px`;
  parts.below.style.height = `${(rows.length - to) * ROW_PX}px`;
  choose(chosen);
  app.want("memory", drawn.filter(({ row }) => row.kind !== "array").map(({ row }) => row.name));
  update();
}

function newRow(row, k) {
  const { name, kind, entry } = row;
  const { type, unit, text, place, writers, dims, isSignal } = entry;
  const [value, scaled] = [td("number value"), td("number")];
  const star = check("", () => toggle(name), watched.includes(name));
  star.box.ariaLabel = star.title = `Watch ${name}`;
  const opener = button(open.has(name) ? "▾" : "▸", "Elements", () => unfold(name), { class: "opener" });
  const links = writers.map((task) => [app.isTask(task) ? app.link(task, "diagram", { task, name }) : task, " "]);
  const canChange = app.hello.operate.allowed && !isSignal && kind !== "array";
  const node = el("tr", { class: kind, onclick: () => choose(first + k) }, [
    td("", kind !== "array" && star),
    el("th", { scope: "row", title: text }, kind === "array" && opener, name),
    [value, scaled, td("", unit), td("hint", kind === "array" ? `${type}(${dims.join(",")})` : type)],
    [td("", links), td("hint", place), td("about", kind === "element" ? "" : text)],
    td("does", canChange && button("Change…", `Change ${name}`, () => app.edit(name))),
  ]);
  return { row, value, scaled, node };
}

function toggle(name) {
  const list = watched.includes(name) ? watched.filter((each) => each !== name) : [...watched, name];
  restate({ watch: list.join(",") });
}

function unfold(name) {
  if (!open.delete(name)) open.add(name);
  gather();
}

function choose(number) {
  chosen = Math.max(0, Math.min(rows.length - 1, number));
  drawn.forEach(({ node }, k) => node.classList.toggle("chosen", first + k === chosen));
}

function keyed(event) {
  if (event.target !== parts.frame || !rows.length) return;
  const { name, kind, entry } = rows[chosen];
  const page = Math.floor(parts.frame.clientHeight / ROW_PX) - 2;
  const steps = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
  if (event.key in steps) {
    choose(chosen + steps[event.key]);
    const { scrollTop, clientHeight } = parts.frame;
    const below = (chosen + 2) * ROW_PX - clientHeight; // under the head
    parts.frame.scrollTop = Math.max(below, Math.min(scrollTop, chosen * ROW_PX));
  } else if (event.key === " " && kind !== "array") toggle(name);
  else if (event.key === "Enter" && kind !== "array" && !entry.isSignal) app.edit(name);
  else if (event.key === (open.has(name) ? "ArrowLeft" : "ArrowRight") && kind === "array") unfold(name);
  else return;
  event.preventDefault();
}

function update() {
  if (!app.hello) return;
  if (params.forced && forcedThen !== JSON.stringify(app.status.forced)) gather();
  for (const { row, value, scaled, node } of drawn) {
    if (row.kind === "array") continue;
    const now = app.value(row.name);
    const words = app.format(row.name, now);
    write(value, words.raw);
    write(scaled, words.scaled);
    value.classList.toggle("true", now === true);
    node.classList.toggle("forced", app.isForced(row.name));
  }
}

export const view = { name: "memory", title: "Memory", create, show, hide: () => app.want("memory", []), update };
