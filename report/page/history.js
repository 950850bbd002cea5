// The simulation step by step, from history.csv.
import uPlot from 'uplot';
import {byId} from './format.js';
import {kColours} from './profile.js';

const kFont = '12px system-ui, sans-serif';

export function drawHistory(csv) {
  const [head, ...rows] = csv.trim().split(/\r?\n/).map((line) => line.split(','));
  const column = (name) => {
    const at = head.indexOf(name);
    return at < 0 ? null : rows.map((row) => Number(row[at]));
  };
  const step = column('step'), residual = column('relative_residual'), radius = column('radius_mm');
  if (!step || !residual || !radius) return;
  byId('simulation-panel').hidden = false;
  const home = byId('history');
  const axis = (label, more) => ({label, stroke: kColours.text, font: kFont, labelFont: kFont,
    grid: {stroke: kColours.grid, width: 1}, ticks: {stroke: kColours.grid, width: 1}, ...more});
  const plot = new uPlot({
    width: home.clientWidth, height: 220, legend: {show: true, live: true},
    scales: {x: {time: false}, residual: {distr: 3}},
    series: [{label: 'step'}, {label: 'stent radius (mm)', scale: 'y', stroke: kColours.target, width: 2, points: {show: false}},
      {label: 'force imbalance', scale: 'residual', stroke: kColours.after, width: 1.5, points: {show: false}}],
    axes: [axis('step', {size: 46}), axis('stent radius (mm)', {scale: 'y', size: 56}),
      axis('unbalanced / contact force', {scale: 'residual', side: 1, size: 70, grid: {show: false}})],
    cursor: {drag: {x: false, y: false}, y: false},
  }, [step, radius, residual.map((value) => (value > 0 ? value : null))], home);
  new ResizeObserver(() => plot.setSize({width: home.clientWidth, height: 220})).observe(home);
}
