// The profile: what is known at each station along the centerline, from profiles.csv or from the stations of
// metrics.json, and where the stations lie.
import {named} from './format.js';
import {across, cross, dot, minus, norm, plus, point, scaled, unit} from './vector.js';

function csvColumns(text) {
  const [head, ...rows] = text.trim().split(/\r?\n/).map((line) => line.split(','));
  const cells = (name, c) => rows.map((row) => (row[c] ?? '').trim());
  const value = (cell) => (cell === '' ? null : Number(cell));
  return Object.fromEntries(head.map((name) => name.trim()).map((name, c) =>
    [name, name === 'flags' ? cells(name, c) : cells(name, c).map(value)]));
}

function stationColumns(stations) {
  const columns = {};
  const put = (name, index, value) => {
    columns[name] ??= new Array(stations.length).fill(null);
    columns[name][index] = value;
  };
  stations.forEach((station, index) => {
    for (const [key, value] of Object.entries(station)) {
      if (value && typeof value === 'object') {
        for (const [inner, x] of Object.entries(value)) if (typeof x === 'number') put(`${key}_${inner}`, index, x);
      } else if (typeof value === 'number') {
        put(key, index, value);
      }
    }
  });
  return columns;
}

const kStates = ['before', 'after', 'target'];

/**
 * {arc, quantities: [{key, label, unit, before, after, target}]}: columns whose names differ only in the word before,
 * after or target belong together; a column without such a word stands alone (`values`).
 */
export function profileOf(summary, metrics) {
  const columns = summary.profiles_csv ? csvColumns(summary.profiles_csv) : stationColumns(metrics.stations ?? []);
  const arcName = Object.keys(columns).find((name) => name.startsWith('arc_length')) ?? Object.keys(columns)[0];
  if (!arcName || columns[arcName].length === 0) return null;
  const flags = (columns.flags ?? []).map((text) => text.split(' '));
  const quantities = new Map();
  for (const [name, values] of Object.entries(columns)) {
    if (name === arcName || /^[xyz](_|$)/.test(name) || values.some((v) => Number.isNaN(v)) || name === 'flags' ||
        values.every((v) => v === null)) continue;
    const words = name.split('_');
    const state = words.find((word) => kStates.includes(word));
    const key = words.filter((word) => word !== state).join('_');
    const entry = quantities.get(key) ?? {key};
    entry[state ?? 'values'] = values;
    quantities.set(key, entry);
  }
  // The target is a lumen's equivalent diameter.
  const target = quantities.get('diameter_mm');
  const equivalent = quantities.get('equivalent_diameter_mm');
  if (target?.target && !target.before && equivalent) {
    equivalent.target = target.target;
    quantities.delete('diameter_mm');
  }
  for (const quantity of quantities.values()) {
    const {words, unit: u} = named(quantity.key);
    quantity.label = words;
    quantity.unit = u;
  }
  const all = [...quantities.values()];
  const first = all.findIndex((q) => q.key === 'equivalent_diameter_mm');
  if (first > 0) all.unshift(...all.splice(first, 1));
  const arc = columns[arcName];
  return {arc, quantities: all, flags, stented: stentedPart(arc, flags, metrics)};
}

/** Arc lengths between which the stent lies, or null where the whole profile is within it. */
function stentedPart(arc, flags, metrics) {
  const inside = arc.filter((_, i) => flags[i]?.includes('in_stent'));
  if (inside.length > 1) return [inside[0], inside[inside.length - 1]];
  const {treated_from_mm: from, treated_to_mm: to} = metrics.lumen ?? {};
  return typeof from === 'number' && typeof to === 'number' ? [from, to] : null;
}

/** The narrowest station before stenting, within the stent and clear of branches where that is known. */
export function narrowestStation({arc, quantities, flags, stented}) {
  const values = quantities[0].before ?? quantities[0].values ?? [];
  let best = -1;
  values.forEach((value, i) => {
    if (value === null || flags[i]?.includes('crosses_branch_before')) return;
    if (stented && (arc[i] < stented[0] || arc[i] > stented[1])) return;
    if (best < 0 || value < values[best]) best = i;
  });
  return Math.max(best, 0);
}

function frameOf(outline) {
  const count = outline.length / 3;
  let centre = [0, 0, 0];
  for (let i = 0; i < count; ++i) centre = plus(centre, point(outline, i), 1 / count);
  let area = [0, 0, 0];
  for (let i = 0; i < count; ++i) {
    area = plus(area, cross(minus(point(outline, i), centre), minus(point(outline, (i + 1) % count), centre)), 0.5);
  }
  return {centre, normal: unit(area)};
}

/**
 * Per station {before, after: outline or null, centre, normal, u, v}: the frames turn as little as can be from one
 * station to the next, so that outlines can be compared.
 */
export function placesOf(profile, outlines, arrays) {
  const places = profile.arc.map(() => ({before: null, after: null, frame: null}));
  const names = Object.keys(arrays ?? {});
  const stationName = names.find((name) => /station/i.test(name));
  const arcName = names.find((name) => /arc/i.test(name));
  const stateName = names.find((name) => /after|which|state/i.test(name));
  outlines.forEach((closed, i) => {
    const ends = closed.length >= 6 ? norm(minus(point(closed, 0), point(closed, closed.length / 3 - 1))) : 1;
    const outline = ends < 1e-9 ? closed.subarray(0, closed.length - 3) : closed;
    const station = stationName ? arrays[stationName][i] :
      arcName ? profile.arc.findIndex((s) => Math.abs(s - arrays[arcName][i]) < 1e-4 * (1 + Math.abs(s))) : -1;
    if (!places[station] || outline.length < 9) return;
    places[station][stateName && arrays[stateName][i] > 0 ? 'after' : 'before'] = outline;
  });
  for (const place of places) {
    const outline = place.before ?? place.after;
    if (outline) place.frame = frameOf(outline);
  }
  const known = places.filter((place) => place.frame);
  known.forEach((place, i) => {
    const next = known[Math.min(i + 1, known.length - 1)].frame.centre;
    const previous = known[Math.max(i - 1, 0)].frame.centre;
    if (dot(place.frame.normal, minus(next, previous)) < 0) place.frame.normal = scaled(place.frame.normal, -1);
    const wish = i > 0 ? known[i - 1].frame.u : [1, 0, 0];
    place.frame.u = across(place.frame.normal, wish);
    place.frame.v = cross(place.frame.normal, place.frame.u);
  });
  return places;
}

/** Where the plane of `frame` cuts the triangles: [[a, b], ...] in the plane's coordinates, within `reach` (mm). */
export function cut(points, triangles, frame, reach) {
  const segments = [];
  const {centre, normal, u, v} = frame;
  const count = points.length / 3;
  const heights = new Float32Array(count);
  for (let i = 0; i < count; ++i) {
    heights[i] = (points[3 * i] - centre[0]) * normal[0] + (points[3 * i + 1] - centre[1]) * normal[1] +
                 (points[3 * i + 2] - centre[2]) * normal[2];
  }
  for (let t = 0; t < triangles.length; t += 3) {
    const above = [heights[triangles[t]] > 0, heights[triangles[t + 1]] > 0, heights[triangles[t + 2]] > 0];
    if (above[0] === above[1] && above[1] === above[2]) continue;
    const ends = [];
    for (let k = 0; k < 3; ++k) {
      const a = triangles[t + k], b = triangles[t + (k + 1) % 3];
      if (heights[a] > 0 === heights[b] > 0) continue;
      const share = heights[a] / (heights[a] - heights[b]);
      const offset = minus(plus(point(points, a), minus(point(points, b), point(points, a)), share), centre);
      ends.push([dot(offset, u), dot(offset, v)]);
    }
    if (ends.every(([x, y]) => Math.hypot(x, y) < reach)) segments.push(ends);
  }
  return segments;
}

export const inPlane = (outline, {centre, u, v}) => {
  const result = [];
  for (let i = 0; i < outline.length / 3; ++i) {
    const offset = minus(point(outline, i), centre);
    result.push([dot(offset, u), dot(offset, v)]);
  }
  return result;
};
