// Numbers, names and units as the page prints them; elements without markup from data.

export function number(value) {
  if (value === null || value === undefined) return '–';
  if (typeof value === 'boolean') return value ? 'yes' : 'no';
  if (typeof value !== 'number') return String(value);
  if (Number.isInteger(value)) return value.toLocaleString('en-US').replaceAll(',', '\u202f').replace('-', '\u2212');
  const size = Math.abs(value);
  const text = size >= 1e-3 && size < 1e6 ? String(Number(value.toPrecision(4))) : value.toExponential(2);
  return text.replace('-', '\u2212');
}

const kUnits = {mm: 'mm', mm2: 'mm²', mm3: 'mm³', deg: '°', percent: '%', N: 'N', MPa: 'MPa', s: 's'};

/** 'min_diameter_mm' -> {words: 'min diameter', unit: 'mm'} */
export function named(key) {
  const words = key.split('_');
  const last = words[words.length - 1];
  if (words.length < 2 || !(last in kUnits)) return {words: words.join(' '), unit: ''};
  if (words[words.length - 2] === 'per') return {words: words.slice(0, -2).join(' '), unit: `1/${kUnits[last]}`};
  return {words: words.slice(0, -1).join(' '), unit: kUnits[last]};
}

export function shownUnit(unit) { return kUnits[unit] ?? unit; }

export function capitalised(text) { return text.charAt(0).toUpperCase() + text.slice(1); }

/** An element with attributes and children; strings become text, never markup. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === 'class') made.className = value;
    else if (name in made && typeof value !== 'string') made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

export const byId = (id) => document.getElementById(id);
export const textBlock = (id) => byId(`data-${id}`).textContent;
export const jsonBlock = (id) => JSON.parse(textBlock(id));
