// Errors and operations in one time line, the newest first.
import { button, check, chip, el, table, td, write } from "./dom.js";
import { app } from "./app.js";
import { seek } from "./player.js";

const KINDS = { error: "Errors", operation: "Operations", note: "Notes" };
const PAGE = 200; // rows that are shown at once, and added by the button

const parts = {};
const hidden = new Set(); // kinds
let rows = new Map(); // number of an entry: its row
let most = PAGE;
let isNews = true;

function create() {
  const filter = () => (app.keep("log", { q: parts.search.value }), again());
  const hide = (kind) => (isShown) => (isShown ? hidden.delete(kind) : hidden.add(kind), again());
  parts.search = el("input", { type: "search", placeholder: "Filter ( / )", "aria-label": "Filter", oninput: filter });
  parts.count = el("span", { class: "hint" });
  parts.body = el("tbody");
  parts.more = button("Show earlier entries", "", () => ((most += PAGE), again()));
  for (const event of ["log", "hello"]) app.on(event, () => (isNews = true));
  app.on("hello", () => rows.clear());
  const bar = [parts.search, Object.entries(KINDS).map(([kind, title]) => check(title, hide(kind), true)), parts.count];
  const entries = table("log-table", ["Time", "Kind", "Task", "What happened", "Scan", "Where"], parts.body);
  const frame = el("div", { class: "frame fills" }, entries, parts.more);
  return el("section", { class: "view-log" }, el("div", { class: "view-bar" }, bar), frame);
}

function again() {
  isNews = true;
  update();
}

/** A click on the time goes there in a recording; for a rack that runs, it opens the line in the task's diagram. */
function newRow({ t, kind, task, what, text, ok, code, line, scan }) {
  const to = app.isTask(task) ? ["diagram", { task, line }] : ["log", { q: parts.search.value }];
  const isRecording = app.hello.kind === "recording";
  const go = (event) => isRecording && (event.preventDefault(), seek({ t }));
  const leads = isRecording || app.isTask(task);
  const isBad = kind === "error" || ok === false;
  const says = [what && el("b", {}, what), what && text && ": ", text, code && [" ", el("code", {}, code)]];
  return el("tr", { class: isBad ? "bad" : "" }, [
    td("number", leads ? app.link(app.clock(t), ...to, { onclick: go }) : app.clock(t)),
    td("", chip(isBad ? "bad" : "muted", kind === "operation" && !ok ? "refused" : kind)),
    [td("", task), td("says", says), td("number", scan || "")],
    td("", app.isTask(task) && app.link(line ? `line ${line}` : "diagram", ...to)),
  ]);
}

function show({ q = "" }) {
  parts.search.value = q;
  isNews = true;
}

function update() {
  if (!app.hello) return;
  if (isNews) renewRows();
  isNews = false;
  const now = app.at?.t ?? Infinity;
  for (const { row, t } of rows.values()) row.classList.toggle("later", t > now);
}

function renewRows() {
  const words = parts.search.value.toUpperCase().split(/\s+/);
  const found = app.log.filter(({ kind, task, what, text, code }) => {
    const all = `${kind} ${task} ${what} ${text} ${code}`.toUpperCase();
    return !hidden.has(kind) && words.every((word) => all.includes(word));
  });
  const shown = found.slice(-most).reverse();
  rows = new Map(shown.map((entry) => [entry.n, rows.get(entry.n) ?? { row: newRow(entry), t: entry.t }]));
  parts.body.replaceChildren(...[...rows.values()].map(({ row }) => row));
  parts.more.hidden = found.length <= most;
  write(parts.count, found.length ? `${found.length} of ${app.log.length}` : "Nothing to show.");
}

export const view = { name: "log", title: "Log", create, show, hide() {}, update };
