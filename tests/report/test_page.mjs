// test_page.mjs VSTENT CHROMIUM: a report in a headless browser. Opens from disk, draws, plays the steps, links plot,
// cross-section and view, shows the figures of metrics.json, complains of nothing and asks for nothing.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {openPage} from './browser.mjs';

const [vstent, chromium] = process.argv.slice(2);
if (!chromium || chromium.endsWith('NOTFOUND')) {
  console.log('skipped: no Chromium on this machine (package chromium)');
  process.exit(77);
}

/** A straight tube of radius 5 mm along z with a round narrowing to 2.5 mm in its middle, as text STL. */
function narrowedTube(path) {
  const around = 32, along = 60, length = 60;
  const at = (i, j) => {
    const z = length * j / along;
    const angle = 2 * Math.PI * i / around;
    const r = 5 - 2.5 * (Math.abs(z - 30) < 8 ? 0.5 * (1 + Math.cos(Math.PI * (z - 30) / 8)) : 0);
    return [r * Math.cos(angle), r * Math.sin(angle), z].map((x) => x.toFixed(9)).join(' ');
  };
  const facets = [];
  const facet = (...corners) => facets.push(`facet normal 0 0 0\nouter loop\n${corners.map((c) => `vertex ${c}\n`).join('')}endloop\nendfacet\n`);
  for (let j = 0; j < along; ++j) {
    for (let i = 0; i < around; ++i) {
      const k = (i + 1) % around;
      facet(at(i, j), at(k, j), at(k, j + 1));
      facet(at(i, j), at(k, j + 1), at(i, j + 1));
    }
  }
  writeFileSync(path, `solid tube\n${facets.join('')}endsolid tube\n`);
}

function run(...args) {
  const done = spawnSync(vstent, args, {encoding: 'utf8'});
  assert.equal(done.status, 0, done.stderr);
  return done;
}

const kColoured = (id) => `(async () => {
  await new Promise(requestAnimationFrame); await new Promise(requestAnimationFrame);
  const source = ${id === 'scene' ? "document.querySelector('#scene > canvas')" : `document.getElementById('${id}')`};
  const copy = Object.assign(document.createElement('canvas'), {width: source.width, height: source.height});
  const context = copy.getContext('2d', {willReadFrequently: true});
  context.drawImage(source, 0, 0);
  const {data} = context.getImageData(0, 0, copy.width, copy.height);
  let drawn = 0, hash = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i + 3] > 0 && Math.min(data[i], data[i + 1], data[i + 2]) < 235) ++drawn;
    hash = (31 * hash + data[i] + 7 * data[i + 1] + 13 * data[i + 2]) | 0;
  }
  return {share: drawn / (data.length / 4), hash};
})()`;
const picture = (page, id) => page.evaluate(kColoured(id));
const stage = async (page, index) => {
  await page.evaluate(`(() => { const s = document.getElementById('stage'); s.value = '${index}'; s.dispatchEvent(new Event('input')); })()`);
  await page.until(`document.documentElement.dataset.stage === '${index}'`);
};
const choose = (page, id, value) => page.evaluate(
  `(() => { const s = document.getElementById('${id}'); s.value = ${JSON.stringify(value)}; s.dispatchEvent(new Event('change')); })()`);

const folder = mkdtempSync(join(tmpdir(), 'vstent-report-'));
const kName = 'OUT <img src=x onerror=console.error(1)>';
let page;
try {
  const wall = join(folder, '<img src=x onerror=console.error(2)>.stl');
  const out = join(folder, kName);
  narrowedTube(wall);
  run('deploy', wall, '--units', 'mm', '--at', 'lesion', '--length', '24mm', '--diameter', '10mm', '--save-steps', '15',
      '--no-pictures', '-o', out);
  const metrics = JSON.parse(readFileSync(join(out, 'metrics.json'), 'utf8'));
  const html = readFileSync(join(out, 'report.html'), 'utf8');
  const steps = (html.match(/id="data-step-/g) ?? []).length;
  assert.ok(steps >= 2, `${steps} steps in the page`);

  page = await openPage(chromium, join(out, 'report.html'));
  await page.until("document.documentElement.dataset.ready === 'yes'");
  const text = (id) => page.evaluate(`document.getElementById('${id}').textContent`);
  assert.equal(await text('title'), kName);
  assert.match(await page.evaluate("document.querySelector('.disclaimer').textContent"), /not for clinical use/);
  assert.match(await text('command'), /^vstent deploy '.*'\/case\.json -o AGAIN$/);

  // Every scalar that the tables show equals metrics.json, and what is said first is there.
  const cells = await page.evaluate(
    "[...document.querySelectorAll('[data-pointer]')].map((cell) => [cell.dataset.pointer, JSON.parse(cell.dataset.value), cell.textContent])");
  const at = (pointer) => pointer.split('/').slice(1).reduce((value, key) => value?.[key], metrics);
  for (const [pointer, value, shown] of cells) {
    assert.deepEqual(value, at(pointer) ?? null, pointer);
    if (typeof value === 'number') {
      const read = Number(shown.replaceAll('\u2212', '-').replaceAll('\u202f', ''));
      assert.ok(Math.abs(read - value) <= 5.1e-3 * Math.abs(value), `${pointer}: ${shown} for ${value}`);
    }
  }
  const shown = new Set(cells.map(([pointer]) => pointer));
  for (const [group, values] of Object.entries(metrics)) {
    if (['stations', 'warnings', 'unmeasured'].includes(group) || values === null || typeof values !== 'object' || Array.isArray(values)) continue;
    for (const [key, value] of Object.entries(values)) {
      if (value === null || typeof value !== 'object') assert.ok(shown.has(`/${group}/${key}`), `/${group}/${key} is in no table`);
    }
  }

  // It draws; other stages, fields and layers look different; the same stage looks the same again.
  const final = await picture(page, 'scene');
  assert.ok(final.share > 0.05 && final.share < 0.95, `${final.share} of the view is drawn on`);
  const hashes = new Map([['after', final.hash]]);
  for (let index = 0; index <= steps; ++index) {
    await stage(page, index);
    hashes.set(await text('stage-label'), (await picture(page, 'scene')).hash);
  }
  assert.equal(new Set(hashes.values()).size, steps + 2, `stages that look alike: ${JSON.stringify([...hashes])}`);
  await stage(page, steps + 1);
  assert.equal((await picture(page, 'scene')).hash, final.hash);
  await choose(page, 'field', '');
  assert.notEqual((await picture(page, 'scene')).hash, final.hash, 'without a field');
  await choose(page, 'field', 'vertex:Displacement');
  assert.equal((await picture(page, 'scene')).hash, final.hash);
  await choose(page, 'map', 'magma');
  assert.notEqual((await picture(page, 'scene')).hash, final.hash, 'another map');
  await choose(page, 'map', 'viridis');
  assert.match(await text('colour-title'), /Displacement \(mm\)/);
  await page.evaluate("document.getElementById('show-stent').click()");
  assert.notEqual((await picture(page, 'scene')).hash, final.hash, 'without the stent');
  await page.evaluate("document.getElementById('show-stent').click()");
  await choose(page, 'mode', 'side');
  assert.ok((await picture(page, 'scene')).share > 0.03);
  await choose(page, 'mode', 'overlay');

  // The pointer on the profile picks the station: its cross-section, its figures, its place in the view.
  const [x, y, width, height] = await page.box('profile');
  await page.evaluate('window.scrollTo(0, 0)');
  const marked = await picture(page, 'scene');
  const seen = [];
  for (const share of [0.3, 0.45, 0.6]) {
    await page.move(x + share * width, y + 0.4 * height);
    await page.until(`document.documentElement.dataset.station !== '${seen.at(-1)?.station ?? -1}'`);
    const station = Number(await page.evaluate('document.documentElement.dataset.station'));
    const section = await picture(page, 'section');
    assert.ok(section.share > 0.02, 'a cross-section is drawn');
    seen.push({station, section: section.hash, view: (await picture(page, 'scene')).hash});
    const diameter = await page.evaluate(`document.querySelector('[data-column="after:equivalent_diameter_mm"]').title`);
    const written = metrics.stations[station].after?.equivalent_diameter_mm;
    assert.equal(diameter, written === undefined ? '' : String(written));
  }
  for (const key of ['station', 'section', 'view']) assert.equal(new Set(seen.map((s) => s[key])).size, 3, `${key}: ${JSON.stringify(seen)}`);
  assert.ok(seen[0].station < seen[1].station && seen[1].station < seen[2].station);
  assert.notEqual(marked.hash, seen[2].view);

  // The pointer on the wall tells the field's value there and moves along the profile.
  const [sx, sy, sw, sh] = await page.box('scene');
  await page.move(sx + 0.5 * sw, sy + 0.62 * sh);
  await page.until("!document.getElementById('scene-tip').hidden");
  assert.match(await text('scene-tip'), /^Displacement \d.* mm$/);
  await page.until(`document.documentElement.dataset.station !== '${seen[2].station}'`);

  assert.deepEqual(page.complaints, []);
  assert.deepEqual(page.requests.filter((url) => !url.startsWith('blob:')).length, 1, `requests: ${page.requests}`);
  assert.equal(await page.evaluate('document.images.length'), 0);
  console.log(`1 page, ${steps} steps, ${cells.length} figures: as they should be`);
} finally {
  await page?.close();
  rmSync(folder, {recursive: true, force: true});
}
