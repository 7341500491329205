// Elements are made here. What comes from outside becomes text nodes and attributes, never markup.

const SVG = "http://www.w3.org/2000/svg";

// An attribute that is false, null or undefined is left out, true is an empty one, a function listens: "onclick".
function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (typeof value === "function") node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, String(value));
  }
  node.append(...children.flat(4).filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

/** @returns {HTMLElement} an element of HTML; children are nodes, texts, or lists of them. */
export const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
/** @returns {SVGElement} an element of SVG. */
export const svg = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);

/** A button; one with a sign in place of words is called by its title. */
export function button(text, title, onclick, more) {
  const label = /\w/.test(text) ? null : title;
  return el("button", { type: "button", title, "aria-label": label, onclick, ...more }, text);
}

export const td = (kind, ...children) => el("td", { class: kind }, children);
export const th = (...children) => el("th", { scope: "row" }, children);
export const chip = (kind, ...children) => el("span", { class: `chip ${kind}` }, children);

export function table(kind, titles, ...bodies) {
  const heads = titles.map((title) => el("th", { scope: "col" }, title));
  return el("table", { class: kind }, el("thead", {}, el("tr", {}, heads)), bodies);
}

export function check(title, onchange, checked = false) {
  const box = el("input", { type: "checkbox", checked, onchange: () => onchange(box.checked) });
  return Object.assign(el("label", {}, box, title), { box });
}

/** Changes an element's text only where it differs: untouched elements cost no layout. */
export function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

const drawn = new WeakMap();

/** Makes an element's content again where the facts that it shows have changed. */
export function renew(node, facts, make) {
  const text = JSON.stringify(facts);
  if (drawn.get(node) === text) return;
  drawn.set(node, text);
  const focused = [...node.querySelectorAll("a, button, summary")].indexOf(document.activeElement);
  node.replaceChildren(...[make()].flat(4).filter(Boolean));
  if (focused >= 0) node.querySelectorAll("a, button, summary")[focused]?.focus();
}
