// The rack as it stands in the cabinet, what stopped it, what is in the way of its drives, and what is worth watching.
import { button, chip, el, renew, td, th, write } from "./dom.js";
import { app } from "./app.js";
import { COLOURS } from "./tasks.js";

// Which booleans stop a drive is read from their names and descriptions: nothing else in a rack file says it.
const FAULT = /^(F_|FAULT|TRIP)|(_FAULT|_TRIP|_LOSS)@|\b(fault|trips?|loss|lost|overspeed)\b/i;
const PERMISSIVE = /(_OK|_PERM|READY|INTERLOCK)@|\b(permissives?|interlocks?|locked|emergency|contacts closed)\b/i;
const HAND = /_PB@|RESET|LAMP|\b(push-button|selector|switch|lamp)\b/i;
const IN_THE_WAY = { faulted: "has faulted", stopped: "is stopped" }; // states of a task

const parts = {};
let conditions = []; // {name, entry, bad}: bad is the value that is in the way
let cells = []; // {name, node}: what shows a value
let names = []; // that are watched
let hand = []; // names of push-buttons and selectors

function create() {
  const card = (key, title) => {
    parts[key] = el("div", { class: key });
    return el("section", { class: "card" }, el("h2", {}, title), parts[key]);
  };
  parts.cabinet = el("div", { class: "cabinet" });
  parts.stop = el("div");
  const cards = [card("way", "In the way of running"), card("acts", "Operating"), card("watched", "Watched")];
  cards.push(card("hand", "Push-buttons and selectors"));
  app.on("hello", greet);
  greet();
  const frame = el("div", { class: "frame" }, parts.cabinet);
  return el("section", { class: "view-rack" }, parts.stop, frame, el("div", { class: "cards" }, cards));
}

function greet() {
  if (!app.hello) return;
  const kindOf = ({ name, text }) => {
    const all = `${name} ${text}`;
    if (HAND.test(all)) return "hand";
    return FAULT.test(name) ? true : PERMISSIVE.test(all) ? false : FAULT.test(text) ? true : "";
  };
  const found = app.hello.names
    .filter(({ type, task, dims }) => type === "boolean" && !task && !dims?.length)
    .map((entry) => ({ name: entry.name, entry, bad: kindOf(entry) }));
  const isInput = ({ entry }) => Number(!entry.writers.length);
  conditions = found.filter(({ bad }) => typeof bad === "boolean").sort((one, two) => isInput(two) - isInput(one));
  hand = found.filter((each) => each.bad === "hand" && isInput(each)).map(({ name }) => name);
  cells = [];
  parts.watched.replaceChildren(values(app.hello.watch));
  parts.hand.replaceChildren(values(hand));
  parts.hand.parentNode.hidden = !hand.length;
  names = [...app.hello.watch, ...conditions.map(({ name }) => name), ...hand];
  app.want("rack", names);
}

const operate = (text, title, verb, fields = {}) => button(text, title, () => app.operate(verb, fields));
const runAll = () => app.hello.operate.allowed && operate("Run all…", "Put all tasks into RUN", "run_all");

function values(some) {
  const rows = some.map((name) => {
    const node = el("span");
    cells.push({ name, node });
    return rowOf(name, node, app.entry(name)?.text);
  });
  return el("table", { class: "values" }, el("tbody", {}, rows));
}

function rowOf(name, value, ...about) {
  const change = app.hello.operate.allowed && button("Change…", `Change ${name}`, () => app.edit(name));
  return el("tr", {}, th(app.link(name, "memory", { q: name })), td("", value), td("about", about), td("does", change));
}

function stopCard({ stopped, powered }) {
  const on = app.hello.operate.allowed && operate("Power on…", "Switch the power on", "power", { what: "on" });
  if (powered === false) return el("article", { class: "card bad" }, el("h2", {}, "The power is off"), on);
  if (!stopped) return [];
  const { t, code, task, title, reason, explain } = stopped;
  const where = app.isTask(task) && ["Task ", app.link(task, "diagram", { task }), ", "];
  const links = [app.link("Log", "log"), " ", app.link("Tasks", "tasks")];
  const page = () => [el("summary", {}, "Explanation"), el("p", { class: "explanation" }, explain)];
  return el("article", { class: "card bad", role: "alert" }, [
    el("h2", {}, `The rack is STOPPED: ${title || reason}`),
    title && reason !== title && el("p", {}, reason),
    el("p", {}, where, `at ${app.clock(t)}`, code && [", problem ", el("code", {}, code)], ". ", links),
    explain && el("details", { open: true }, page()),
    el("p", { class: "does" }, "What to do: remove the cause, then put all tasks into RUN. ", runAll()),
  ]);
}

function newModule({ slot, model, title, lamps, display, tasks, plant }) {
  const states = statesOf();
  const lamp = ({ name, on, colour }) => {
    const isBare = /^\d+\.\d+$/.test(name); // a bit that no variable has
    const sign = el("i", { class: on ? `lamp ${colour}` : "lamp" });
    const link = () => (app.entry(name) ? app.link(name, "memory", { q: name }) : name);
    return isBare ? el("li", { class: "bare", title: name }, sign) : el("li", {}, sign, link());
  };
  const link = (task) => {
    const status = states.get(task)?.status;
    return app.link(task, "diagram", { task }, { class: `chip ${COLOURS[status] ?? "muted"}`, title: status });
  };
  const node = el("article", { class: "module", "aria-label": `Slot ${slot}: ${model}` }, [
    [el("p", { class: "slot" }, slot), el("h3", {}, model), el("p", { class: "hint" }, title)],
    el("ul", {}, lamps.map(lamp)),
    display && [el("p", { class: "digits" }, display.code || "\u00a0\u00a0"), el("p", {}, display.meaning)],
    [tasks.map(link), el("p", { class: "live" }), plant && app.link(`plant ${plant}`, "drive")],
  ]);
  node.style.gridColumn = slot + 1;
  return node;
}

const statesOf = () => new Map(app.status.tasks?.map((each) => [each.name, each]));

/** What changes all the time is written into the element that is there: in one made again a click would be lost. */
function liveOf({ slot, load_percent: load, late, tasks }, states, drives) {
  const round = (value) => (typeof value === "number" ? value.toFixed(0) : "–");
  const drive = drives.find((each) => each.slot === slot);
  if (drive) return `${round(drive.speed_rpm)} rpm, ${round(drive.armature_a)} A, ${drive.state}`;
  const skipped = tasks.reduce((sum, task) => sum + (states.get(task)?.skipped ?? 0), 0);
  const percent = typeof load === "number" ? `load ${load.toFixed(0)} %, ` : "";
  return tasks.length ? `${percent}${late} late, ${skipped} skipped` : "";
}

/** What is in the way: faults of drives and tasks, then conditions that are not met: inputs, then what tasks decide. */
function wayOf(drives, tasks, open, held) {
  const rows = open.map(({ name, entry: { text, writers, place }, bad }) => {
    const by = writers.map((task) => [" ", app.link(`${task} decides`, "diagram", { task, name })]);
    const from = writers.length ? by : el("span", { class: "hint" }, ` (${place || "from outside"})`);
    const forced = app.isForced(name) && chip("forced", "forced");
    return rowOf(name, [el("b", { class: "bad" }, String(bad).toUpperCase()), forced], text, from);
  });
  const lines = drives.flatMap(([plant, faults, broken]) => [
    ...faults.map((text) => [app.link(plant, "drive"), `: ${text}`]),
    ...broken.map((text) => [app.link(plant, "drive"), ` is broken: ${text}`]),
  ]);
  lines.push(...tasks.map(([task, state]) => [app.link(task, "tasks"), ` ${IN_THE_WAY[state]}`]));
  lines.push(...held.map((name) => [app.link(name, "memory", { q: name }), " is forced"]));
  const says = rows.length
    ? "The first lines are causes; what tasks decide follows from them."
    : "No condition is open. A drive that stands still waits for its start or its reference, or a button holds it.";
  return [
    el("ul", {}, lines.map((line) => el("li", { class: "bad" }, line))),
    el("table", { class: "values" }, el("tbody", {}, rows)),
    el("p", { class: "hint" }, says, " ", app.link("What happened before: Log", "log")),
    drives.some(([, faults, broken]) => faults.length + broken.length) &&
      el("p", { class: "does" }, "Repair it in ", app.link("Drive", "drive"), resets()),
  ];
}

function resets() {
  const switches = app.hello.switches.filter(({ control }) => control.includes("reset"));
  const buttons = switches.flatMap(({ slot, control, values: positions }) =>
    positions.map((value) => {
      const fields = { name: String(slot), control, value };
      return operate(`${control.replaceAll("_", " ")} ${value}…`, `Switch in slot ${slot}`, "module", fields);
    }),
  );
  return app.hello.operate.allowed && buttons.length ? [", then reset: ", buttons] : "";
}

function actsOf(operators) {
  const { allowed, why } = app.hello.operate;
  const acts = () => [
    runAll(),
    operate("Stop all…", "Stop the rack", "stop_all"),
    ["off", "on"].map((what) => operate(`Power ${what}…`, "Switch the rack's power", "power", { what })),
    operate("Clear errors…", "Clear the error logs of all tasks", "clear_errors", { task: "" }),
  ];
  const who = operators?.length ? `May operate: ${operators.join(", ")}.` : "Nobody else may operate.";
  return [el("p", { class: "does" }, allowed ? acts() : `Look only: ${why}.`), el("p", { class: "hint" }, who)];
}

const show = () => app.want("rack", names);

function update() {
  if (!app.hello) return;
  const { stopped, powered, slots = [], drives = [], operators, tasks = [] } = app.status;
  renew(parts.stop, [stopped, powered], () => stopCard(app.status));
  const modules = slots.map(({ load_percent: _, late: __, ...facts }) => facts);
  renew(parts.cabinet, [modules, tasks.map(({ status }) => status)], () => slots.map(newModule));
  const states = statesOf();
  parts.cabinet.querySelectorAll(".live").forEach((node, k) => write(node, liveOf(slots[k], states, drives)));
  const faults = drives.map(({ plant, faults: each, broken }) => [plant, each, broken]);
  const isStill = ({ status }) => !stopped && status in IN_THE_WAY;
  const still = tasks.filter(isStill).map(({ name, status }) => [name, status]);
  const open = conditions.filter(({ name, bad }) => app.value(name) === bad);
  const forced = open.map(({ name }) => app.isForced(name));
  const held = hand.filter(app.isForced);
  renew(parts.way, [faults, still, open, forced, held], () => wayOf(faults, still, open, held));
  renew(parts.acts, [operators, app.hello.operate], () => actsOf(operators));
  for (const { name, node } of cells) {
    const value = app.value(name);
    write(node, app.format(name, value).shown);
    node.className = `value ${value === true ? "true" : ""} ${app.isForced(name) ? "forced" : ""}`;
  }
}

export const view = { name: "rack", title: "Rack", create, show, hide: () => app.want("rack", []), update };
