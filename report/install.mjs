// install.mjs NPM SOURCE WORK: the libraries that package-lock.json pins, into WORK/node_modules.
import {spawnSync} from 'node:child_process';
import {copyFileSync, mkdirSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

const [npm, source, work] = process.argv.slice(2);
mkdirSync(work, {recursive: true});
for (const file of ['package.json', 'package-lock.json']) copyFileSync(join(source, file), join(work, file));

const options = ['--ignore-scripts', '--no-audit', '--no-fund', '--prefer-offline', '--fetch-retries=1', '--loglevel=error'];
const npmCi = spawnSync(npm, ['ci', ...options], {cwd: work, encoding: 'utf8'});
if (npmCi.status !== 0) {
  const said = `${npmCi.error ?? ''}${npmCi.stderr ?? ''}`;
  const why = said.split('\n').find((line) => /E[A-Z]{3,}|network|ENOENT/.test(line)) ?? said.split('\n')[0];
  console.error(`error: npm could not fetch the report page's libraries (${why.trim()}); ` +
                'connect to the registry, or configure with -DVSTENT_REPORT=OFF to build without the report');
  process.exit(1);
}
writeFileSync(join(work, 'installed'), '');
