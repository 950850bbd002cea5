// bundle.mjs WORK PAGE OUT: page/main.js with its libraries and page/style.css, inlined into page/template.html.
import {createHash} from 'node:crypto';
import {existsSync, readdirSync, readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';

const [work, page, out] = process.argv.slice(2);
const esbuild = createRequire(join(work, 'package.json'))('esbuild');

async function bundled(file) {
  const result = await esbuild.build({
    nodePaths: [join(work, 'node_modules')],  // the sources lie elsewhere than the libraries
    entryPoints: [join(page, file)], bundle: true, minify: true, write: false, format: 'iife',
    target: ['chrome90', 'firefox113', 'safari16.4'], charset: 'utf8', logLevel: 'warning'});
  return result.outputFiles[0].text.replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--').trim();
}
const hash = (text) => `'sha256-${createHash('sha256').update(text).digest('base64')}'`;

/** The licence texts of the libraries that end up in the page. */
function licences() {
  const modules = join(work, 'node_modules');
  const inPage = Object.entries(JSON.parse(readFileSync(join(work, 'package-lock.json'), 'utf8')).packages)
    .filter(([path, entry]) => path.startsWith('node_modules/') && !entry.dev).map(([path]) => path.slice('node_modules/'.length));
  return inPage.filter((name) => existsSync(join(modules, name))).sort().map((name) => {
    const file = readdirSync(join(modules, name)).find((entry) => /^licen[cs]e/i.test(entry));
    if (!file) throw new Error(`${name} has no licence text`);
    return `${name}\n\n${readFileSync(join(modules, name, file), 'utf8').trim()}`;
  }).join('\n\n\n').replaceAll('&', '&amp;').replaceAll('<', '&lt;');
}

const script = await bundled('main.js');
const style = await bundled('style.css');
const parts = {script, style, licences: licences(), policy:
  `default-src 'none'; script-src ${hash(script)}; style-src ${hash(style)}; img-src data: blob:; base-uri 'none'; form-action 'none'`};
const html = readFileSync(join(page, 'template.html'), 'utf8').replace(/\{\{(\w+)\}\}/g, (_, name) => parts[name]);
writeFileSync(out, html);
