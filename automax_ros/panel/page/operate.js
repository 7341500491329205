// Operating in two steps: the program says what an operation would do, and only a confirmation does it.
import { button, el, write } from "./dom.js";
import { app } from "./app.js";

const NOTE_MS = 6000;
let noteTimer = 0;

/** Says a result in a corner of the page, and to screen readers. */
export function say(text, kind = "bad") {
  const said = document.getElementById("said");
  said.className = kind;
  said.textContent = text;
  clearTimeout(noteTimer);
  noteTimer = setTimeout(() => (said.textContent = ""), NOTE_MS);
}

function refuses() {
  const why = app.hello.operate.allowed ? "" : `Not operated: ${app.hello.operate.why}`;
  const reason = app.connected ? why : "The connection is lost; nothing was sent.";
  if (reason) say(reason);
  return Boolean(reason);
}

function dialog(title, ...content) {
  const node = el("dialog", { "aria-label": title, onclose: () => node.remove() }, el("h2", {}, title), content);
  document.body.append(node);
  node.showModal();
  say("");
  return node;
}

/** Prepares an operation, shows what it would do, and sends it when confirmed. Resolves to the answer, or to null. */
app.operate = async (verb, fields, tell = say) => {
  if (refuses()) return null;
  const prepared = await app.request("prepare", { verb, fields }).catch(({ message }) => tell(message));
  return prepared ? new Promise((resolve) => confirm(prepared, resolve)) : null;
};

function confirm({ ticket, text, seconds }, resolve) {
  const rest = el("p", { class: "hint" });
  const yes = button("Confirm", "Send it to the rack", send, { class: "primary" });
  const no = button("Cancel", "Send nothing (Escape)", () => box.close(), { autofocus: true });
  const content = [el("p", { class: "sentence" }, text), rest, el("p", { class: "does" }, no, yes)];
  const box = dialog("Confirm the operation", content);
  const end = performance.now() + seconds * 1000;
  const timer = setInterval(count, 250);
  let answer = null;
  box.addEventListener("close", () => (clearInterval(timer), resolve(answer)));
  count();

  function count() {
    const left = Math.ceil((end - performance.now()) / 1000);
    if (!app.connected) fail("The connection was lost; nothing was sent.");
    else if (left <= 0) fail("The time to confirm is over; nothing was sent.");
    else write(rest, `Nothing has been sent to the rack yet. Time to confirm: ${left} s.`);
  }

  function fail(reason) {
    clearInterval(timer);
    rest.replaceWith(el("p", { class: "bad", role: "alert" }, reason));
    yes.remove();
    write(no, "Close");
  }

  async function send() {
    clearInterval(timer);
    yes.disabled = true;
    answer = await app.request("confirm", { ticket }).catch(({ message }) => {
      fail(`${message} The Log shows whether it was done.`);
      return null;
    });
    if (answer && !answer.ok) fail(`The rack refused: ${answer.reason}`);
    if (answer?.ok) say(`Done: ${text.replace(/: [^:]* now$/, "")}`, "good"); // without how it was before
    if (answer?.ok) box.close();
  }
}

/** Opens the dialog that sets, forces or tunes a variable. */
app.edit = (name) => {
  if (refuses()) return;
  const { type, text, task, tunable, scale, unit, writers = [] } = app.entry(name);
  const value = app.value(name);
  const now = app.format(name, value);
  const options = ["TRUE", "FALSE"].map((each) => el("option", { selected: each !== now.raw }, each));
  const input = type === "boolean" ? el("select", {}, options) : el("input", { value: value === null ? "" : now.raw });
  const act = (label, verb, title, fields) => {
    const onclick = async () => {
      write(refused, "");
      box.inert = true; // a second click would ask twice
      const tell = (reason) => write(refused, reason);
      const answer = await app.operate(verb, fields ?? { name, value: input.value }, tell);
      box.inert = false;
      if (answer?.ok) box.close();
      else input.focus();
    };
    return button(label, title, onclick);
  };
  const acts = [
    !tunable && !task && act("Set…", "set", "Write the value once; the task that writes the variable may replace it"),
    !tunable && act("Force…", "force", "Hold the value against every write, until the force is ended"),
    tunable && act("Tune…", "tune", "Give the tunable this value"),
    app.isForced(name) && act("End force…", "unforce", "Let the variable go", { names: [name] }),
  ];
  const { low, high, step } = tunable ?? {};
  const limits = tunable ? ` From ${low} to ${high}, in steps of ${+step.toPrecision(6)}.` : "";
  const refused = el("p", { class: "bad", role: "alert" });
  const forced = app.isForced(name) ? ", forced" : "";
  const replaced = writers.length && !tunable ? ` ${writers.join(", ")} may replace a value that is set.` : "";
  const form = el(
    "form",
    { onsubmit: (event) => (event.preventDefault(), acts.find(Boolean).click()) },
    [el("p", {}, text), el("p", { class: "hint" }, `Now ${now.shown}${forced}.${limits}${replaced}`)],
    [el("label", {}, "New value ", input, scale ? ` counts, not ${unit}` : ""), refused],
    el("p", { class: "does" }, button("Cancel", "Change nothing", () => box.close()), acts),
  );
  const box = dialog(name, form);
  input.focus();
};
