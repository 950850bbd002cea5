// Colour maps and the colour bar.
import {interpolateCividis, interpolateMagma, interpolateRdBu, interpolateViridis} from 'd3-scale-chromatic';
import {byId, element, number} from './format.js';

export const kMaps = {
  viridis: interpolateViridis,
  cividis: interpolateCividis,
  magma: interpolateMagma,
  'blue–red': (share) => interpolateRdBu(1 - share),
};

export const kNoValueColour = [196, 200, 205];

function rgb(text) {
  if (text.startsWith('#')) return [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16));
  return text.match(/\d+/g).slice(0, 3).map(Number);
}

/** RGBA bytes of 256 colours, low to high. */
export function colourTable(name) {
  const table = new Uint8Array(4 * 256);
  for (let i = 0; i < 256; ++i) table.set([...rgb(kMaps[name](i / 255)), 255], 4 * i);
  return table;
}

/** Round numbers within [low, high], about five. */
export function ticks(low, high) {
  const rough = (high - low) / 5;
  if (!(rough > 0)) return [low];
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step = decade * [1, 2, 5, 10].find((factor) => factor * decade >= rough);
  const result = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i) result.push(Number((i * step).toPrecision(12)));
  return result;
}

export function drawColourBar(map, {label, unit, low, high, beyondLow, beyondHigh}) {
  const context = byId('colour-bar').querySelector('canvas').getContext('2d');
  const table = colourTable(map);
  const image = context.createImageData(1, 256);
  for (let i = 0; i < 256; ++i) image.data.set(table.subarray(4 * (255 - i), 4 * (256 - i)), 4 * i);
  context.putImageData(image, 0, 0);
  byId('colour-title').textContent = unit ? `${label} (${unit})` : label;
  const home = byId('colour-ticks');
  home.replaceChildren();
  const room = 0.06 * (high - low);
  const inner = ticks(low, high).filter((value) => value - low > room && high - value > room);
  const put = (value, text) => {
    const tick = element('span', {}, text);
    tick.style.bottom = `${high > low ? 100 * (value - low) / (high - low) : 0}%`;
    home.append(tick);
  };
  put(low, (beyondLow ? '≤ ' : '') + number(Number(low.toPrecision(3))));
  for (const value of inner) put(value, number(value));
  if (high > low) put(high, (beyondHigh ? '≥ ' : '') + number(Number(high.toPrecision(3))));
  byId('range-low').value = String(Number(low.toPrecision(4)));
  byId('range-high').value = String(Number(high.toPrecision(4)));
}
