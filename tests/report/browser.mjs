// A headless Chromium, spoken to over a pipe in its debugging protocol; no library, no network.
import {spawn} from 'node:child_process';
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

export async function openPage(program, file, {width = 1440, height = 1000} = {}) {
  const profile = mkdtempSync(join(tmpdir(), 'vstent-browser-'));
  const chromium = spawn(program, ['--headless=new', '--no-sandbox', '--disable-dev-shm-usage', '--use-gl=angle',
    '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--no-first-run', '--disable-extensions',
    '--disable-background-networking', '--disable-component-update', '--disable-sync', '--mute-audio', '--hide-scrollbars',
    '--force-color-profile=srgb', `--user-data-dir=${profile}`, `--window-size=${width},${height}`,
    '--remote-debugging-pipe', 'about:blank'], {stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe']});
  const [, , , input, output] = chromium.stdio;
  const waiting = new Map();
  const listeners = [];
  let next = 0;
  let rest = '';
  output.setEncoding('utf8');
  output.on('data', (text) => {
    const messages = (rest + text).split('\0');
    rest = messages.pop();
    for (const message of messages.map((m) => JSON.parse(m))) {
      if (message.id === undefined) for (const listener of listeners) listener(message);
      else if (message.error) waiting.get(message.id)?.reject(new Error(message.error.message));
      else waiting.get(message.id)?.resolve(message.result);
    }
  });
  const ended = new Promise((resolve) => chromium.on('exit', resolve));
  ended.then(() => { for (const {reject} of waiting.values()) reject(new Error('the browser ended')); });
  chromium.on('error', (error) => { for (const {reject} of waiting.values()) reject(error); });
  const send = (method, params = {}, sessionId) => new Promise((resolve, reject) => {
    waiting.set(++next, {resolve, reject});
    input.write(`${JSON.stringify({id: next, method, params, sessionId})}\0`);
  });

  const {targetId} = await send('Target.createTarget', {url: 'about:blank'});
  const {sessionId} = await send('Target.attachToTarget', {targetId, flatten: true});
  const call = (method, params) => send(method, params, sessionId);
  const page = {requests: [], complaints: []};
  listeners.push(({method, params}) => {
    if (method === 'Network.requestWillBeSent') page.requests.push(params.request.url);
    if (method === 'Runtime.exceptionThrown') page.complaints.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === 'Runtime.consoleAPICalled' && ['error', 'warning', 'assert'].includes(params.type)) {
      page.complaints.push(params.args.map((a) => a.value ?? a.description).join(' '));
    }
    if (method === 'Log.entryAdded' && ['error', 'warning'].includes(params.entry.level)) page.complaints.push(params.entry.text);
  });
  for (const domain of ['Page', 'Runtime', 'Network', 'Log']) await call(`${domain}.enable`);
  await call('Emulation.setDeviceMetricsOverride', {width, height, deviceScaleFactor: 1, mobile: false});
  await call('Page.navigate', {url: pathToFileURL(file).href});

  page.evaluate = async (expression) => {
    const {result, exceptionDetails} = await call('Runtime.evaluate', {expression, awaitPromise: true, returnByValue: true});
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  };
  page.until = async (expression, seconds = 60) => {
    for (const end = Date.now() + 1000 * seconds; Date.now() < end;) {
      if (await page.evaluate(expression).catch(() => false)) return;
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
    throw new Error(`not within ${seconds} s: ${expression}\n${page.complaints.join('\n')}`);
  };
  page.move = (x, y) => call('Input.dispatchMouseEvent', {type: 'mouseMoved', x, y});
  page.box = (id) => page.evaluate(`(() => { const b = document.getElementById('${id}').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()`);
  page.screenshot = async (path, whole = false) => {
    const {data} = await call('Page.captureScreenshot', {format: 'png', captureBeyondViewport: whole});
    writeFileSync(path, Buffer.from(data, 'base64'));
  };
  page.close = async () => {
    await send('Browser.close').catch(() => {});
    await ended;
    rmSync(profile, {recursive: true, force: true, maxRetries: 5});
  };
  return page;
}
