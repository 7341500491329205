// The tasks: states, periods, scan times, and their error logs with explanations.
import { button, el, renew, table, td, th, write } from "./dom.js";
import { app } from "./app.js";

const FIXED = ["Task", "Slot", "Priority", "Period"];
const COLUMNS = [...FIXED, "State", "Scans", "Skipped", "Mean", "Longest", "Of period", "Errors", ""];
const CHANGING = ["state", "scans", "skipped", "mean", "longest", "share", "errors"];
export const COLOURS = { running: "good", faulted: "bad", stopped: "warn" };

const parts = { body: el("tbody"), errors: el("div", { class: "cards" }) };
const explained = new Map(); // task, place, line and code of an error: its element, which may be open
let rows = new Map(); // name of a task: its row, and its cells by CHANGING

function create() {
  app.on("hello", greet);
  greet();
  const frame = el("div", { class: "frame" }, table("task-table", COLUMNS, parts.body));
  return el("section", { class: "view-tasks" }, frame, el("h2", {}, "Error logs"), parts.errors);
}

function greet() {
  explained.clear();
  rows = new Map(app.hello?.tasks.map((task) => [task.name, newRow(task)]));
  parts.body.replaceChildren(...[...rows.values()].map(({ row }) => row));
}

function newRow({ name: task, slot, priority, period_ms: period, file }) {
  const cells = Object.fromEntries(CHANGING.map((key) => [key, td(key === "state" ? "" : "number")]));
  const act = (verb, title) => button(`${verb}…`, title, () => app.operate(verb, { task }));
  const acts = () => [act("run", "Put it into RUN"), act("stop", "Stop it"), act("clear", "Clear its error log")];
  const facts = [slot, priority, period ? `${Number(period.toFixed(3))} ms` : "–"].map((fact) => td("number", fact));
  const head = th(app.link(task, "diagram", { task }, { title: file }));
  const row = el("tr", {}, head, facts, Object.values(cells), td("does", app.hello.operate.allowed && acts()));
  return { row, period, ...cells };
}

function update() {
  if (!app.hello || !app.status.tasks) return;
  const micros = (value) => (typeof value === "number" ? `${value.toFixed(value < 100 ? 1 : 0)} µs` : "–");
  for (const { name, status: state, scans, skipped, mean_us: mean, longest_us: longest, errors } of app.status.tasks) {
    const cells = rows.get(name);
    const share = typeof mean === "number" && cells.period ? `${(mean / (10 * cells.period)).toFixed(1)} %` : "–";
    const texts = { state, scans, skipped, mean: micros(mean), longest: micros(longest), share, errors: errors.count };
    for (const key of CHANGING) write(cells[key], String(texts[key]));
    cells.state.className = COLOURS[state] ?? "";
    cells.skipped.classList.toggle("warn", skipped > 0);
    cells.errors.classList.toggle("bad", errors.count > 0);
  }
  const faulty = app.status.tasks.filter(({ errors }) => errors.count).map(({ name, errors }) => [name, errors]);
  const none = () => el("p", { class: "hint" }, "No error is logged.");
  renew(parts.errors, faulty, () => (faulty.length ? faulty.map(newCard) : none()));
}

function newCard([task, { count, entries }]) {
  const items = entries.map((entry) => el("li", {}, entryOf(task, entry)));
  return el("article", { class: "card bad" }, el("h3", {}, `${task}: ${count} logged`), el("ul", {}, items));
}

function entryOf(task, { place, line, code, text, scan }) {
  const key = [task, place, line, code].join(" ");
  if (!explained.has(key)) explained.set(key, el("details", {}, el("summary", {}, el("code", {}, code), ` ${text}`)));
  const details = explained.get(key);
  details.ontoggle = () => details.childElementCount > 1 || explain(details, code);
  return [`${place}, scan ${scan}, `, app.link(`line ${line}`, "diagram", { task, line }), details];
}

/** Fetches the explanation of a problem's code into an element. */
async function explain(details, code) {
  const { text } = await app.request("explain", { code }).catch(({ message }) => ({ text: message }));
  details.append(el("p", { class: "explanation" }, text));
}

export const view = { name: "tasks", title: "Tasks", create, show() {}, hide() {}, update };
