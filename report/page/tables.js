// The figures of metrics.json as tables: known ones with their definitions, unknown ones by their keys.
import {byId, capitalised, element, named, number, shownUnit} from './format.js';

const kShownAsProfile = new Set(['stations', 'profiles', 'warnings', 'unmeasured']);
const kLongestList = 40;

const isScalar = (value) => value === null || typeof value !== 'object';
const isTable = (value) => Array.isArray(value) && value.length > 0 &&
  value.every((entry) => entry && typeof entry === 'object' && !Array.isArray(entry));

const escaped = (key) => key.replaceAll('~', '~0').replaceAll('/', '~1');

/** Every scalar below `value`, with its JSON pointer. */
function* leaves(value, pointer) {
  if (isScalar(value)) yield {pointer, value};
  else if (Array.isArray(value)) {
    if (value.every(isScalar)) yield {pointer, value};
  } else {
    for (const [key, inner] of Object.entries(value)) yield* leaves(inner, `${pointer}/${escaped(key)}`);
  }
}

function* tablesBelow(value, pointer) {
  if (isScalar(value)) return;
  if (isTable(value)) yield {pointer, rows: value};
  else if (!Array.isArray(value)) {
    for (const [key, inner] of Object.entries(value)) yield* tablesBelow(inner, `${pointer}/${escaped(key)}`);
  }
}

export function valueAt(metrics, pointer) {
  let value = metrics;
  for (const key of pointer.split('/').slice(1)) value = value?.[key.replaceAll('~1', '/').replaceAll('~0', '~')];
  return value;
}

function describe(pointer, definitions) {
  const known = definitions.find(pointer);
  if (known) return {label: known.label, unit: shownUnit(known.unit), meaning: known.meaning, absent: known.absent};
  const keys = pointer.split('/').slice(2);
  const last = named(keys.pop() ?? pointer.slice(1));
  return {label: capitalised([...keys.map((key) => key.replaceAll('_', ' ')), last.words].join(', ')), unit: last.unit, meaning: ''};
}

/** Definitions by JSON pointer, where `*` stands for any one key. */
function definitionsIn(list) {
  const exact = new Map(list.map((definition) => [definition.key, definition]));
  const patterns = list.filter(({key}) => key.includes('*')).map((definition) => ({definition, keys: definition.key.split('/')}));
  const matches = (keys, pattern) => keys.length === pattern.length && keys.every((key, i) => pattern[i] === '*' || pattern[i] === key);
  return {find: (pointer) => exact.get(pointer) ?? patterns.find(({keys}) => matches(pointer.split('/'), keys))?.definition};
}

const twin = (pointer) => pointer.replace(/(^|[_/])before(?=$|[_/])/, '$1after');
const withoutState = (label) => capitalised(label.replace(/,?\s*\b(before|after)\b/i, '').trim());

function valueCell(pointer, value, span = 1) {
  const text = Array.isArray(value) ? (value.length === 0 ? 'none' :
    value.length > kLongestList ? `${value.length} values` : value.map(number).join(', ')) : number(value);
  return element('td', {class: 'value', 'data-pointer': pointer, 'data-value': JSON.stringify(value),
    title: JSON.stringify(value), colSpan: span}, text);
}

function groupTable(entries, definitions) {
  const byPointer = new Map(entries.map((entry) => [entry.pointer, entry]));
  const paired = entries.some(({pointer}) => twin(pointer) !== pointer && byPointer.has(twin(pointer)));
  const body = element('tbody');
  const done = new Set();
  for (const {pointer, value} of entries) {
    if (done.has(pointer)) continue;
    const {label, unit, meaning, absent} = describe(pointer, definitions);
    const why = value === null && absent ? ` Not known: ${absent}.` : '';
    const other = twin(pointer) !== pointer ? byPointer.get(twin(pointer)) : undefined;
    const row = element('tr');
    if (other) {
      done.add(other.pointer);
      row.append(element('th', {scope: 'row'}, withoutState(label)), valueCell(pointer, value), valueCell(other.pointer, other.value));
    } else {
      row.append(element('th', {scope: 'row'}, label), valueCell(pointer, value, paired ? 2 : 1));
    }
    row.append(element('td', {class: 'unit'}, unit), element('td', {class: 'meaning'}, meaning + why));
    body.append(row);
  }
  const head = [...(paired ? ['', 'before', 'after'] : ['', 'value']), '', ''];
  return element('table', {class: 'figures'},
    element('thead', {}, element('tr', {}, ...head.map((text) => element('th', {scope: 'col'}, text)))), body);
}

function listTable({pointer, rows}, definitions) {
  const shown = rows.slice(0, kLongestList);
  const keys = [...new Set(rows.flatMap((row) => Object.keys(row)))].filter((key) => rows.some((row) => isScalar(row[key])));
  const heading = (key) => {
    const known = definitions.find(`${pointer}/0/${escaped(key)}`);
    const {words, unit: itsUnit} = named(key);
    const {label, unit, meaning} = known ? {...known, unit: shownUnit(known.unit)} : {label: capitalised(words), unit: itsUnit, meaning: ''};
    return element('th', {scope: 'col', title: meaning}, unit ? `${label} (${unit})` : label);
  };
  const table = element('table', {class: 'figures list'},
    element('thead', {}, element('tr', {}, ...keys.map(heading))),
    element('tbody', {}, ...shown.map((row, i) => element('tr', {},
      ...keys.map((key) => (isScalar(row[key]) ? valueCell(`${pointer}/${i}/${escaped(key)}`, row[key] ?? null) : element('td')))))));
  const keysAbove = pointer.split('/');
  const title = keysAbove.length > 2 ? element('h3', {}, capitalised(named(keysAbove.pop()).words)) : null;
  const more = rows.length > shown.length ? element('p', {class: 'note'}, `${rows.length - shown.length} further rows are in metrics.json.`) : null;
  return element('div', {class: 'scroll'}, ...[title, table, more].filter(Boolean));
}

export function fillTables(metrics, definitionList) {
  const definitions = definitionsIn(definitionList);
  const general = [];
  const home = byId('tables');
  const add = (title, parts) => home.append(element('section', {class: 'panel'}, element('h2', {}, title), ...parts));
  for (const [key, value] of Object.entries(metrics)) {
    if (kShownAsProfile.has(key)) continue;
    const pointer = `/${escaped(key)}`;
    if (isScalar(value)) {
      general.push({pointer, value});
      continue;
    }
    const entries = [...leaves(value, pointer)];
    const parts = entries.length > 0 ? [element('div', {class: 'scroll'}, groupTable(entries, definitions))] : [];
    for (const table of tablesBelow(value, pointer)) parts.push(listTable(table, definitions));
    if (parts.length > 0) add(capitalised(key.replaceAll('_', ' ')), parts);
  }
  const reasons = Object.entries(metrics.unmeasured ?? {});
  if (reasons.length > 0) {
    const row = ([pointer, reason]) => element('tr', {}, element('th', {scope: 'row'}, describe(pointer, definitions).label),
      element('td', {class: 'meaning'}, String(reason)));
    add('Not measured', [element('table', {class: 'figures'}, element('tbody', {}, ...reasons.map(row)))]);
  }
  if (general.length > 0) add('Reference', [element('div', {class: 'scroll'}, groupTable(general, definitions))]);
}

const kHeadlines = [
  {title: 'Narrowest lumen', before: '/lumen/narrowest_before_mm', after: '/lumen/narrowest_after_mm', unit: 'mm'},
  {title: 'Diameter stenosis', before: '/lumen/diameter_stenosis_before_percent', after: '/lumen/diameter_stenosis_after_percent', unit: '%'},
  {title: 'Smallest lumen area', before: '/lumen/minimum_lumen_area_before_mm2', after: '/lumen/minimum_lumen_area_after_mm2', unit: 'mm²'},
  {title: 'Bend along the stent', before: '/shape/stent_bend_before_deg', after: '/shape/stent_bend_after_deg', unit: '°'},
  {title: 'Largest gap to the wall', after: '/apposition/largest_gap_mm', unit: 'mm'},
  {title: 'Circumferential stretch, 95 %', after: '/wall/circumferential_stretch_p95', unit: ''},
  {title: 'Wall moved by up to', after: '/shape/largest_displacement_mm', unit: 'mm'},
  {title: 'Largest gap to the struts', after: '/struts/largest_gap_mm', unit: 'mm'},
  {title: 'Prolapse between struts', after: '/struts/largest_prolapse_mm', unit: 'mm'},
];

export function fillHeadlines(metrics) {
  const short = (value) => (typeof value === 'number' ? String(Number(value.toPrecision(3))).replace('-', '\u2212') : number(value));
  for (const {title, before, after, unit} of kHeadlines) {
    const now = valueAt(metrics, after);
    const then = before ? valueAt(metrics, before) : undefined;
    if (typeof now !== 'number') continue;
    byId('headlines').append(element('div', {class: 'headline'}, element('p', {}, title),
      element('p', {class: 'figure'},
        ...(typeof then === 'number' ? [element('span', {class: 'then'}, short(then)), ' → '] : []),
        element('span', {class: 'now'}, short(now)), element('span', {class: 'unit'}, `\u202f${unit}`))));
  }
}

export function fillWarnings(metrics, summary) {
  const warnings = [...(metrics.warnings ?? []), ...summary.warnings];
  if (metrics.simulation?.converged === false) warnings.unshift('the forces between stent and wall are not balanced: the result is not converged');
  for (const key of ['inverted_triangles', 'new_self_intersections']) {
    const count = metrics.mesh?.[key];
    if (count > 0) warnings.unshift(`the stented surface has ${count} ${key.replaceAll('_', ' ')}`);
  }
  for (const text of warnings) byId('warnings').append(element('p', {class: 'warning'}, capitalised(String(text))));
  if (warnings.length === 0) byId('warnings').append(element('p', {class: 'fine'}, 'No warnings.'));
}
