// The plot along the centerline and the cross-section at the station under the pointer.
import uPlot from 'uplot';
import {byId, capitalised, element, number} from './format.js';
import {ticks} from './colours.js';
import {cut, inPlane} from './stations.js';

export const kColours = {before: '#5d6974', after: '#a82a22', target: '#3f6f9f', values: '#a82a22', stent: '#3f5f7f', text: '#1d2733', grid: '#e4e8ec'};
const kNames = {before: 'before', after: 'after', target: 'nominal', values: ''};
const kFont = '12px system-ui, sans-serif';

function axis(label) {
  return {label, stroke: kColours.text, font: kFont, labelFont: kFont, grid: {stroke: kColours.grid, width: 1}, ticks: {stroke: kColours.grid, width: 1}};
}

/** A lumen's shortest and longest diameters, where the profile has them, shade the equivalent one. */
function bandsFor(profile, quantity) {
  if (quantity.key !== 'equivalent_diameter_mm') return [];
  const find = (key) => profile.quantities.find((q) => q.key === key);
  const [low, high] = [find('min_diameter_mm'), find('max_diameter_mm')];
  if (!low || !high) return [];
  return ['before', 'after'].filter((s) => low[s] && high[s]).map((state) => ({state, low: low[state], high: high[state]}));
}

export class Profile {
  /** `onStation(index)` is called when the pointer or the keys move. */
  constructor(home, profile, onStation) {
    Object.assign(this, {home, profile, onStation, station: null, whole: false});
    new ResizeObserver(() => this.plot?.setSize(this.size())).observe(home);
    home.addEventListener('keydown', (event) => {
      const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
      if (step === undefined) return;
      event.preventDefault();
      onStation(Math.min(Math.max((this.station ?? 0) + step, 0), profile.arc.length - 1));
    });
  }

  size() { return {width: Math.max(this.home.clientWidth, 200), height: Math.max(this.home.clientHeight, 160)}; }

  showWhole(whole) {
    this.whole = whole;
    this.setQuantity(this.quantity);
  }

  /** The stent with half its length on either side, or everything. */
  range() {
    const {arc, stented} = this.profile;
    const [first, last] = [arc[0], arc[arc.length - 1]];
    if (this.whole || !stented) return [first, last];
    const margin = 0.5 * (stented[1] - stented[0]);
    return [Math.max(first, stented[0] - margin), Math.min(last, stented[1] + margin)];
  }

  setQuantity(quantity) {
    this.quantity = quantity;
    this.plot?.destroy();
    const {flags} = this.profile;
    const clear = (state, values) => values.map((value, i) => (flags[i]?.includes(`crosses_branch_${state}`) ? null : value));
    const data = [this.profile.arc];
    const series = [{}];
    const bands = [];
    for (const {state, low, high} of bandsFor(this.profile, quantity)) {
      data.push(clear(state, high), clear(state, low));
      series.push({stroke: 'transparent', points: {show: false}}, {stroke: 'transparent', points: {show: false}});
      bands.push({series: [data.length - 2, data.length - 1], fill: `${kColours[state]}22`});
    }
    const legend = [];
    for (const state of ['target', 'before', 'after', 'values']) {
      if (!quantity[state]) continue;
      data.push(clear(state, quantity[state]));
      series.push({stroke: kColours[state], width: state === 'target' ? 1.5 : 2.2, dash: state === 'target' ? [6, 5] : undefined, points: {show: false}});
      const swatch = element('span', {class: `swatch ${state}`});
      legend.push(element('span', {}, swatch, kNames[state] || quantity.label));
    }
    if (this.profile.stented) legend.push(element('span', {}, element('span', {class: 'swatch stented'}), 'stent'));
    if (bands.length > 0) legend.push(element('span', {class: 'note'}, 'shaded: shortest to longest diameter'));
    if (flags.some((list) => list.some((flag) => flag.startsWith('crosses_branch')))) {
      legend.push(element('span', {class: 'note'}, 'gaps: the section runs into a branch'));
    }
    byId('profile-legend').replaceChildren(...legend);
    const unit = quantity.unit ? ` (${quantity.unit})` : '';
    this.plot = new uPlot({
      ...this.size(), series, bands, legend: {show: false}, scales: {x: {time: false, range: () => this.range()}},
      axes: [{...axis('arc length (mm)'), size: 46}, {...axis(capitalised(quantity.label) + unit), size: 56}],
      cursor: {drag: {x: false, y: false}, y: false, points: {size: 8}},
      hooks: {setCursor: [(plot) => {
        const index = plot.cursor.idx;
        if (index !== null && index !== undefined) this.onStation(index);
      }],
      drawClear: [(plot) => this.shadeStent(plot)], draw: [(plot) => this.drawStation(plot)]},
    }, data, this.home);
  }

  setStation(index) {
    this.station = index;
    this.plot?.redraw(false, false);
  }

  shadeStent(plot) {
    const {stented} = this.profile;
    if (!stented) return;
    const [from, to] = stented.map((s) => plot.valToPos(s, 'x', true));
    const {ctx: context, bbox} = plot;
    const left = Math.max(from, bbox.left), right = Math.min(to, bbox.left + bbox.width);
    context.save();
    context.fillStyle = '#3f6f9f14';
    context.fillRect(left, bbox.top, right - left, bbox.height);
    context.restore();
  }

  drawStation(plot) {
    if (this.station === null) return;
    const x = plot.valToPos(this.profile.arc[this.station], 'x', true);
    const {ctx: context, bbox} = plot;
    context.save();
    context.strokeStyle = kColours.text;
    context.lineWidth = devicePixelRatio;
    context.beginPath();
    context.moveTo(x, bbox.top);
    context.lineTo(x, bbox.top + bbox.height);
    context.stroke();
    context.restore();
  }
}

function trace(context, points, toPixel, closed) {
  context.beginPath();
  points.forEach((p, i) => (i === 0 ? context.moveTo(...toPixel(p)) : context.lineTo(...toPixel(p))));
  if (closed) context.closePath();
}

/** Half the side (mm) of a square that holds every outline. */
export function sectionReach(places) {
  let reach = 0;
  for (const place of places.filter((p) => p?.frame)) {
    for (const outline of [place.before, place.after]) {
      if (!outline) continue;
      for (const [x, y] of inPlane(outline, place.frame)) reach = Math.max(reach, Math.abs(x), Math.abs(y));
    }
  }
  return reach > 0 ? reach : 1e-3;
}

/** The cross-section before and after, with the stent where the plane cuts it. */
export function drawSection(place, reach, stent) {
  const canvas = byId('section');
  const ratio = window.devicePixelRatio || 1;
  const side = canvas.clientWidth;
  canvas.width = canvas.height = Math.round(side * ratio);
  const context = canvas.getContext('2d');
  context.scale(ratio, ratio);
  context.clearRect(0, 0, side, side);
  const scale = 0.46 * side / reach;
  const toPixel = ([x, y]) => [0.5 * side + scale * x, 0.5 * side - scale * y];
  context.font = kFont;
  context.fillStyle = kColours.text;
  if (!place?.frame) {
    context.textAlign = 'center';
    context.fillText('no closed cross-section here', 0.5 * side, 0.5 * side);
    return;
  }
  context.lineJoin = 'round';
  for (const [state, width] of [['before', 1.8], ['after', 2.4]]) {
    if (!place[state]) continue;
    trace(context, inPlane(place[state], place.frame), toPixel, true);
    context.fillStyle = `${kColours[state]}1c`;
    context.fill();
    context.strokeStyle = kColours[state];
    context.lineWidth = width;
    context.stroke();
  }
  if (stent) {
    context.strokeStyle = kColours.stent;
    context.lineWidth = 1.5;
    for (const segment of cut(stent.points, stent.triangles, place.frame, 1.3 * reach)) {
      trace(context, segment, toPixel, false);
      context.stroke();
    }
  }
  const bar = ticks(0, reach).find((value) => value > 0) ?? reach;
  context.fillStyle = kColours.text;
  context.fillRect(8, side - 10, bar * scale, 2);
  context.textAlign = 'left';
  context.fillText(`${number(bar)} mm`, 8, side - 15);
}

export function describeStation(profile, index) {
  const flags = (profile.flags[index] ?? []).map((flag) => flag.replaceAll('_', ' ')).join(', ');
  byId('section-title').replaceChildren(`At ${number(Number(profile.arc[index].toFixed(2)))} mm`,
    ...(flags ? [element('span', {class: 'note'}, ` ${flags}`)] : []));
  const states = ['before', 'after'].filter((state) => profile.quantities.some((q) => q[state]));
  const rows = profile.quantities.filter((q) => states.some((s) => q[s]) || q.values).slice(0, 12).map((q) => {
    const cells = q.values ? [element('td', {colSpan: Math.max(states.length, 1)}, number(q.values[index]))] :
      states.map((state) => element('td', {'data-column': `${state}:${q.key}`, title: String(q[state]?.[index] ?? '')}, number(q[state]?.[index])));
    return element('tr', {}, element('th', {scope: 'row'}, q.label), ...cells, element('td', {class: 'unit'}, q.unit));
  });
  byId('section-table').replaceChildren(element('thead', {}, element('tr', {}, ...['', ...states, ''].map((text) => element('th', {scope: 'col', class: text}, text)))),
    element('tbody', {}, ...rows));
}
