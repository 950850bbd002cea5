// The report: reads the data blocks of this file and joins the views.
import {colourTable, drawColourBar, kMaps} from './colours.js';
import {byId, capitalised, element, jsonBlock, named, number, textBlock} from './format.js';
import {drawHistory} from './history.js';
import {describeStation, drawSection, Profile, sectionReach} from './profile.js';
import {narrowestStation, placesOf, profileOf} from './stations.js';
import {fillHeadlines, fillTables, fillWarnings} from './tables.js';
import {lines, unpack} from './unpack.js';
import {lookAlong, View} from './view.js';
import {minus, norm, plus, point, scaled} from './vector.js';

const summary = jsonBlock('summary');
const metrics = jsonBlock('metrics');
const specification = jsonBlock('case');

function fillTexts() {
  document.title = `${summary.name} – stent deployment`;
  byId('title').textContent = summary.name;
  const stent = specification.stent ?? {};
  const facts = [stent.design ? `design ${stent.design}` : stent.cell && `${stent.cell}-cell stent`,
    stent.diameter && `${stent.diameter} wide`, stent.length && `${number(parseFloat(stent.length))} mm long`,
    specification.vessel?.surface && `in ${String(specification.vessel.surface).split('/').pop()}`];
  byId('subtitle').textContent = facts.filter(Boolean).join(', ');
  for (const place of document.querySelectorAll('[data-text]')) place.textContent = summary[place.dataset.text];
  byId('made-by').textContent = `Made by vstent ${summary.version}.`;
  const quoted = /^[\w./@%+=:,-]+$/.test(summary.folder) ? summary.folder : `'${summary.folder.replaceAll("'", `'\\''`)}'`;
  byId('command').textContent = `vstent deploy ${quoted}/case.json -o AGAIN`;
  byId('case-text').textContent = textBlock('case').replaceAll('\\u003c', '<');
  byId('copy-command').addEventListener('click', () => navigator.clipboard?.writeText(byId('command').textContent));
  const offer = (id, text, type) => {
    byId(id).href = URL.createObjectURL(new Blob([text], {type}));
    byId(id).hidden = false;
  };
  offer('save-case', textBlock('case'), 'application/json');
  offer('save-metrics', textBlock('metrics'), 'application/json');
  if (summary.profiles_csv) offer('save-profile', summary.profiles_csv, 'text/csv');
}

const kFieldTexts = {
  Displacement: {label: 'Displacement', unit: 'mm'},
  StretchCircumferential: {label: 'Circumferential stretch', unit: ''},
  StretchAxial: {label: 'Axial stretch', unit: ''},
  AreaRatio: {label: 'Area ratio', unit: ''},
  StentDistance: {label: 'Distance to the stent', unit: 'mm'},
};

function fieldText(name) {
  if (kFieldTexts[name]) return kFieldTexts[name];
  const {words, unit} = named(name);
  return {label: words, unit};
}

function quantiles(values, shares) {
  const sorted = Float32Array.from(values).filter((v) => !Number.isNaN(v)).sort();
  return shares.map((share) => sorted[Math.round(share * (sorted.length - 1))] ?? 0);
}

function optionList(select, entries) {
  select.replaceChildren(...entries.map(([value, text]) => element('option', {value}, text)));
}

/** Stages: before, the saved steps, after. Each {label, load() -> {points, triangles, stent}}. */
function stagesOf(arrays, raw) {
  const before = {points: arrays.before, triangles: arrays.triangles, stent: null};
  const finalStent = arrays.stent ? {points: arrays.stent, triangles: arrays['stent.triangles']} : null;
  const after = {points: arrays.after, triangles: arrays.triangles, stent: finalStent};
  const steps = [...document.querySelectorAll('script[id^="data-step-"]')].map((block) => {
    let loaded = null;
    const number = Number(block.id.slice('data-step-'.length));
    const load = async () => {
      const step = await unpack(JSON.parse(block.textContent).pack, {...raw});
      return {points: step.wall, triangles: step['wall.triangles'] ?? arrays.triangles,
        stent: {points: step.stent, triangles: step['stent.triangles']}};
    };
    return {step: number, label: `step ${number}`, load: () => (loaded ??= load())};
  });
  steps.sort((a, b) => a.step - b.step);
  return [{label: 'before', load: async () => before}, ...steps, {label: 'after', load: async () => after, final: true}];
}

function lookAt(arrays, places, centerlines) {
  const focus = arrays.stent ?? arrays.after;
  let low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const bounds = (points) => {
    low = [Infinity, Infinity, Infinity];
    high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < points.length; ++i) {
      low[i % 3] = Math.min(low[i % 3], points[i]);
      high[i % 3] = Math.max(high[i % 3], points[i]);
    }
    return {centre: scaled(plus(low, high), 0.5), size: norm(minus(high, low))};
  };
  const whole = bounds(arrays.after);
  const near = bounds(focus);
  const line = places.filter((place) => place.frame).map((place) => place.frame.centre);
  const around = centerlines.flatMap((l) => Array.from({length: l.length / 3}, (_, i) => point(l, i)))
    .filter((p) => norm(minus(p, near.centre)) < 1.5 * near.size);
  const look = line.length > 1 ? lookAlong([line[0], ...around, line[line.length - 1]], near.centre, 1.15 * near.size)
    : lookAlong([point(focus, 0), point(focus, focus.length / 3 - 1)], near.centre, 1.15 * near.size);
  look.depth = 4 * whole.size;
  return {look, whole};
}

async function start() {
  fillTexts();
  fillWarnings(metrics, summary);
  fillHeadlines(metrics);
  fillTables(metrics, summary.definitions);
  if (summary.history_csv) drawHistory(summary.history_csv);

  const scene = jsonBlock('scene');
  const raw = {};
  const arrays = await unpack(scene.pack, raw);
  const stages = stagesOf(arrays, raw);
  const centerlines = lines(arrays.centerline, arrays['centerline.counts']);
  const struts = lines(arrays.struts, arrays['struts.counts']);
  const outlines = lines(arrays.outlines, arrays['outlines.counts']);
  const profile = profileOf(summary, metrics);
  const places = profile ? placesOf(profile, outlines, scene.outline_arrays) : [];
  const stentedPlaces = places.filter((_, i) => !profile.stented || (profile.arc[i] >= profile.stented[0] && profile.arc[i] <= profile.stented[1]));
  const stentReach = sectionReach(stentedPlaces);
  const reachAt = (place) => Math.max(stentReach, sectionReach([place]));
  const finalStent = arrays.stent ? {points: arrays.stent, triangles: arrays['stent.triangles']} : null;

  const {look, whole} = lookAt(arrays, stentedPlaces, centerlines);
  let view = null;
  try {
    view = new View(byId('scene'), look);
  } catch (error) {
    byId('scene').append(element('p', {class: 'warning'}, 'This browser cannot draw in three dimensions (WebGL is missing); the plots and tables below are complete.'));
  }

  const state = {stage: stages.length - 1, field: '', map: 'viridis', low: 0, high: 1, station: null, current: null};
  const fields = scene.fields.map((field) => ({...field, values: arrays[field.array], perTriangle: field.on === 'triangle', ...fieldText(field.name)}));
  const field = () => fields.find((f) => f.array === state.field);

  function paintWall() {
    if (!view || !state.current) return;
    const chosen = field();
    let shown = null;
    if (chosen && stages[state.stage].final) shown = chosen.values;
    else if (chosen?.name === 'Displacement' && state.current.points.length === arrays.before.length) {
      shown = new Float32Array(arrays.before.length / 3)
        .map((_, i) => norm(minus(point(state.current.points, i), point(arrays.before, i))));
    }
    view.setWall(state.current, shown && {values: shown, perTriangle: chosen.perTriangle, low: state.low, high: state.high, table: colourTable(state.map)});
    byId('colour-bar').hidden = !chosen;
    if (chosen) {
      const [least, most] = chosen.range;
      drawColourBar(state.map, {label: chosen.label, unit: chosen.unit, low: state.low, high: state.high,
        beyondLow: least < state.low, beyondHigh: most > state.high});
    }
    const parts = [];
    if (chosen && !shown) parts.push(`${chosen.label} is known for the last stage only.`);
    if (scene.stent && scene.stent.triangles < scene.stent.triangles_in_file) {
      parts.push(`The stent is drawn with ${number(scene.stent.triangles)} of its ${number(scene.stent.triangles_in_file)} triangles, within about ${number(Number(scene.stent.error_mm.toPrecision(1)))} mm.`);
    }
    parts.push(`Coordinates are rounded to ${number(Number(scene.rounding_mm.toPrecision(1)))} mm.`);
    parts.push('Drag turns, wheel zooms, right drag moves.');
    byId('scene-note').textContent = parts.join(' ');
    state.shownValues = shown;
  }

  function chooseField(array) {
    state.field = array;
    const chosen = field();
    if (chosen) {
      chosen.range ??= quantiles(chosen.values, [0, 1]);
      const [inner, outer] = [quantiles(chosen.values, [0.002, 0.998]), chosen.range];
      const outlying = outer[1] - outer[0] > 1.5 * (inner[1] - inner[0]);
      [state.low, state.high] = outlying && inner[1] > inner[0] ? inner : outer;
    }
    paintWall();
  }

  async function chooseStage(index) {
    state.stage = index;
    const stage = stages[index];
    byId('stage').value = String(index);
    byId('stage-label').textContent = stage.label;
    byId('side-after').textContent = stage.label;
    const loaded = await stage.load();
    if (state.stage !== index) return;
    state.current = loaded;
    view?.setStent(loaded.stent);
    paintWall();
    document.documentElement.dataset.stage = String(index);
  }

  let plot = null;
  function chooseStation(index) {
    if (state.station === index) return;
    state.station = index;
    plot?.setStation(index);
    drawSection(places[index], reachAt(places[index]), finalStent);
    describeStation(profile, index);
    view?.setStation(places[index], 0.004 * look.size);
    document.documentElement.dataset.station = String(index);
  }

  optionList(byId('field'), [['', 'none'], ...fields.map((f) => [f.array, f.label])]);
  optionList(byId('map'), Object.keys(kMaps).map((name) => [name, name]));
  byId('field').addEventListener('change', (event) => chooseField(event.target.value));
  byId('map').addEventListener('change', (event) => { state.map = event.target.value; paintWall(); });
  for (const [id, key] of [['range-low', 'low'], ['range-high', 'high']]) {
    byId(id).addEventListener('change', (event) => {
      const value = Number(event.target.value);
      if (Number.isFinite(value)) state[key] = value;
      paintWall();
    });
  }
  byId('range-full').addEventListener('click', () => { [state.low, state.high] = field().range; paintWall(); });
  byId('stage').max = String(stages.length - 1);
  byId('stage').addEventListener('input', (event) => chooseStage(Number(event.target.value)));
  if (view) connectView(view, {stages, arrays, struts, centerlines, look, whole, state, field, places, chooseStation});

  view?.setBefore({points: arrays.before, triangles: arrays.triangles});
  const first = fields.find((f) => f.name === 'Displacement') ?? fields[0];
  if (first) byId('field').value = first.array;
  await chooseStage(stages.length - 1);
  chooseField(first?.array ?? '');

  if (profile) {
    optionList(byId('quantity'), profile.quantities.map((q, i) => [String(i), capitalised(q.label)]));
    byId('quantity').addEventListener('change', (event) => { plot.setQuantity(profile.quantities[Number(event.target.value)]); });
    plot = new Profile(byId('profile'), profile, chooseStation);
    plot.setQuantity(profile.quantities[0]);
    byId('whole-profile').parentElement.hidden = !profile.stented;
    byId('whole-profile').addEventListener('change', (event) => plot.showWhole(event.target.checked));
    chooseStation(narrowestStation(profile));
    new ResizeObserver(() => drawSection(places[state.station], reachAt(places[state.station]), finalStent)).observe(byId('section'));
  } else {
    byId('profile-panel').hidden = true;
  }
  document.documentElement.dataset.ready = 'yes';
}

function connectView(view, {arrays, struts, centerlines, look, whole, state, field, places, chooseStation}) {
  view.setLines('struts', struts);
  view.setLines('centerline', centerlines);
  const check = (key, text, set) => {
    const box = element('input', {type: 'checkbox', checked: view.shown[key] ?? view[key], id: `show-${key}`});
    box.addEventListener('change', () => set(box.checked));
    byId('layers').append(element('label', {}, box, ` ${text}`));
  };
  const layer = (key, text) => check(key, text, (on) => { view.shown[key] = on; view.dirty = true; });
  layer('wall', 'wall');
  layer('before', 'wall before');
  if (arrays.stent) layer('stent', 'stent');
  if (struts.length > 0) layer('struts', 'strut lines');
  layer('centerline', 'centerline');
  check('cutOpen', 'cut open', (on) => { view.cutOpen = on; view.applyCut(); });
  const opacity = element('input', {type: 'range', min: '0.05', max: '1', step: '0.05', value: String(view.opacity), id: 'opacity'});
  opacity.addEventListener('input', () => { view.opacity = Number(opacity.value); view.applyOpacity(); });
  byId('layers').append(element('label', {}, 'opacity ', opacity));

  byId('mode').addEventListener('change', (event) => {
    byId('side-labels').hidden = event.target.value !== 'side';
    view.setMode(event.target.value);
  });
  byId('focus-stent').addEventListener('click', () => view.focus(look.centre, look.size));
  byId('focus-all').addEventListener('click', () => view.focus(whole.centre, whole.size));
  byId('picture').addEventListener('click', () => {
    element('a', {href: view.picture(), download: `${summary.name}.png`}).click();
  });

  const tip = byId('scene-tip');
  let waiting = false;
  const canvas = view.renderer.domElement;
  canvas.addEventListener('pointermove', (event) => {
    if (event.buttons !== 0 || waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      const hit = view.pick(event);
      tip.hidden = !hit;
      if (!hit) return;
      const chosen = field();
      const value = chosen && state.shownValues ? state.shownValues[chosen.perTriangle ? hit.triangle : hit.vertex] : undefined;
      tip.textContent = value === undefined ? hit.position.map((x) => x.toFixed(1)).join(', ') + ' mm'
        : Number.isNaN(value) ? `${chosen.label}: no value` : `${chosen.label} ${number(Number(value.toPrecision(3)))} ${chosen.unit}`;
      const box = view.home.getBoundingClientRect();
      tip.style.left = `${event.clientX - box.left + 14}px`;
      tip.style.top = `${event.clientY - box.top + 14}px`;
      let best = -1, least = Infinity;
      places.forEach((place, i) => {
        if (!place.frame) return;
        const distance = norm(minus(place.frame.centre, hit.position));
        if (distance < least) [best, least] = [i, distance];
      });
      if (best >= 0 && least < 0.5 * look.size) chooseStation(best);
    });
  });
  canvas.addEventListener('pointerleave', () => { tip.hidden = true; });
}

start().catch((error) => {
  byId('warnings').prepend(element('p', {class: 'warning'}, typeof DecompressionStream === 'undefined'
    ? 'This browser is too old for the drawings (it needs Chrome 80, Firefox 113, Safari 16.4 or later); the tables are complete.'
    : `The drawings failed: ${error.message}`));
  console.error(error);
});
