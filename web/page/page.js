// The page: connects its controls with the viewer, which is Rust (`web/src/browser/viewer.rs`).
//
// `?present=copy` reads finished pictures back and draws them, for browsers that compute but cannot present.

import init, { Viewer, headerBytes, isFixedRate, linkedInfill, linkedVolume } from "./web.js";
import { control } from "./controls.js";
import { converted, fromFile, fromUrl, pieces } from "./source.js";

const BUNDLED = "brain.zfp";
const BUNDLED_ISOVALUE = 58;
/** Bytes that may wait for the GPU before the network has to. */
const MOST_WAITING = 4 << 20;
/** Bytes that are copied to the module's memory at a time. */
const MOST_PUSHED = 1 << 20;
const MOST_PIXELS_PER_AXIS = 4096;
const SETTINGS = ["scale", "budget", "threshold", "strategy", "infill"];

const element = (id) => document.getElementById(id);
const copies = new URLSearchParams(location.search).get("present") === "copy";

let viewer;
let memory;
let address = null;
let loading = null;
let running = false;
let shownAt = null;
let captured = null;
/** The controls' values that the viewer has accepted last. */
let inForce = null;

// ---------------------------------------------------------------- messages

function say(text) {
  element("message").hidden = !text;
  element("message").firstElementChild.textContent = text ?? "";
}

function sayLoading(text, share) {
  element("loading").hidden = text === null;
  element("loading-text").textContent = text ?? "";
  if (share === undefined) element("progress").removeAttribute("value");
  else element("progress").value = share;
}

const reason = (error) => error.message ?? String(error);

// ---------------------------------------------------------------- the loop

/** Goes on until there is nothing left to do; whatever changes something calls it again. */
function wake() {
  if (viewer && !running) {
    running = true;
    requestAnimationFrame(step);
  }
}

function step() {
  running = false;
  try {
    const busy = viewer.advance();
    takeCopy();
    takeCapture();
    const refusal = viewer.takeRefusal();
    if (refusal) refuse(refusal);
    else if (viewer.areSettingsApplied()) inForce = SETTINGS.map((id) => element(id).value);
    showRows(busy);
    if (busy) wake();
  } catch (error) {
    stop(reason(error));
  }
}

/** Settings that are not possible: the controls go back to those in force. */
function refuse(reason) {
  SETTINGS.forEach((id, i) => inForce && (element(id).value = inForce[i]));
  describeSettings();
  say(`These settings are not possible: ${reason}. The last ones stay.`);
}

/** After a fault of the device nothing works any more. */
function stop(text) {
  loading?.abort();
  viewer = null;
  element("state").textContent = "stopped";
  sayLoading(null);
  say(`The GPU gave up: ${text}. Reload the page to start again.`);
}

function takeCopy() {
  const picture = copies && viewer.takeCopy();
  if (!picture) return;
  const canvas = element("canvas");
  canvas.width = picture.width();
  canvas.height = picture.height();
  // The pixels come from main memory, so the canvas may stay there.
  canvas.getContext("2d", { willReadFrequently: true }).putImageData(image(picture), 0, 0);
  picture.free();
}

function image(picture) {
  return new ImageData(new Uint8ClampedArray(picture.color()), picture.width(), picture.height());
}

function takeCapture() {
  const picture = captured && viewer.takeCapture();
  if (!picture) return;
  captured(picture);
  captured = null;
}

/** The newest picture as the renderer made it. */
function capture() {
  return new Promise((resolve) => {
    captured = resolve;
    viewer.startCapture();
    wake();
  });
}

function showRows(busy) {
  const completeness = viewer.completeness();
  if (completeness > 0 && shownAt === null) shownAt = performance.now();
  const rows = viewer.rows();
  const list = element("rows");
  for (let i = 0; i < rows.length; i += 2) {
    const [name, value] = [list.children[i] ?? list.appendChild(document.createElement("dt")),
      list.children[i + 1] ?? list.appendChild(document.createElement("dd"))];
    if (name.textContent !== rows[i]) name.textContent = rows[i];
    if (value.textContent !== rows[i + 1]) value.textContent = rows[i + 1];
  }
  while (list.children.length > rows.length) list.lastChild.remove();
  element("completeness").textContent = rows[1] ?? "0 %";
  element("meter").value = completeness;
  element("state").textContent = loading ? "loading" : !rows.length ? "no volume" : busy ? "rendering" : "finished";
}

// ---------------------------------------------------------------- volumes

/** Ends what is loading. */
function giveUp() {
  loading?.abort();
  viewer?.giveUp();
  loading = null;
}

/** Replaces the volume, when the new one has its first picture; any fault before leaves the old one. */
async function load(open, newAddress, fragment) {
  giveUp();
  const job = new AbortController();
  loading = job;
  say(null);
  sayLoading("Opening");
  wake();
  try {
    const source = await open(job.signal);
    const incoming = pieces(source.bytes, headerBytes());
    const first = (await incoming.next()).value ?? new Uint8Array(0);
    const whole = chain(first, incoming);
    let [stream, geometry, about] = [{ length: source.length, pieces: whole }, [], ""];
    if (!isFixedRate(first.subarray(0, headerBytes()))) {
      const tell = (share) => sayLoading(`Compressing ${source.name}`, share);
      const counted = count(whole, source.length, `Loading ${source.name}`);
      stream = await converted(source.name, source.length, counted, tell, job.signal);
      ({ geometry, about } = stream);
    }
    for await (const piece of count(stream.pieces, stream.length, `Loading ${source.name}`)) {
      if (job.signal.aborted) return;
      if (!job.opened) {
        viewer.open(piece.subarray(0, headerBytes()), new Float64Array(geometry));
        viewer.restore(fragment);
        job.opened = true;
        wake();
      }
      await push(piece, job.signal);
    }
    if (!job.opened) throw new Error(`${source.name} is empty`);
    viewer.finish();
    while (viewer.isOpening()) {
      sayLoading("To the GPU", viewer.loaded());
      await new Promise(requestAnimationFrame);
      if (job.signal.aborted) return;
    }
    loading = null;
    sayLoading(null);
    address = newAddress;
    element("name").textContent = about ? `${source.name}: ${about}` : source.name;
    begin();
  } catch (error) {
    if (job.signal.aborted) return;
    giveUp();
    sayLoading(null);
    say(reason(error));
    wake();
  }
}

/** Hands bytes over as the GPU takes them: a browser may deliver a whole file as one piece. */
async function push(piece, signal) {
  for (let at = 0; at < piece.length; at += MOST_PUSHED) {
    viewer.push(piece.subarray(at, at + MOST_PUSHED));
    wake();
    while (viewer && viewer.waiting() > MOST_WAITING) await new Promise((resolve) => setTimeout(resolve));
    if (signal.aborted) return;
  }
}

async function* chain(first, rest) {
  yield first;
  yield* rest;
}

async function* count(incoming, length, text) {
  let received = 0;
  for await (const piece of incoming) {
    received += piece.length;
    sayLoading(text, length ? received / length : undefined);
    yield piece;
  }
}

/** The volume is there: its values are known. */
function begin() {
  const [lowest, highest] = viewer.range();
  for (const id of ["isovalue", "isovalue-number", "save", "share", "reset"]) element(id).disabled = false;
  element("share").disabled = address === null;
  element("share").title = address === null ? "A file of this computer has no address to link to" : "";
  const slider = element("isovalue");
  slider.min = lowest;
  slider.max = highest;
  element("lowest").textContent = short(lowest);
  element("highest").textContent = short(highest);
  showIsovalue();
  drawHistogram();
  wake();
}

const short = (value) => Number(value.toPrecision(4)).toString();

function showIsovalue() {
  const isovalue = viewer.isovalue();
  element("isovalue").value = isovalue;
  element("isovalue-number").value = Number(isovalue.toPrecision(6));
}

function drawHistogram() {
  const canvas = element("histogram");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.round(n * devicePixelRatio));
  if (!viewer || !width) return;
  [canvas.width, canvas.height] = [width, height];
  const context = canvas.getContext("2d");
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
  const bars = viewer.bars();
  const [lowest, highest] = viewer.range();
  const at = (viewer.isovalue() - lowest) / (highest - lowest);
  // The slider's knob does not reach the ends.
  const inset = 8 * devicePixelRatio;
  const inner = width - 2 * inset;
  bars.forEach((bar, i) => {
    const [from, to] = [i, i + 1].map((n) => inset + Math.round((n / bars.length) * inner));
    context.fillStyle = i / bars.length < at ? colour("--bar") : colour("--accent");
    context.globalAlpha = i / bars.length < at ? 1 : 0.55;
    context.fillRect(from, height, to - from, -Math.round(bar * height));
  });
  context.globalAlpha = 1;
  context.fillStyle = colour("--ink");
  context.fillRect(inset + at * inner - devicePixelRatio / 2, 0, devicePixelRatio, height);
}

// ---------------------------------------------------------------- controls

function connect() {
  const change = (act) => (...values) => {
    act(...values);
    wake();
  };
  control(element("canvas"), {
    turn: change((right, down) => viewer?.turn(right, down)),
    move: change((right, down) => viewer?.move(right, down)),
    zoom: change((factor) => viewer?.zoom(factor)),
    reset: change(() => viewer?.resetView()),
  });
  element("reset").onclick = change(() => viewer?.resetView());
  for (const id of ["isovalue", "isovalue-number"]) {
    element(id).addEventListener("input", (event) => {
      if (!viewer || event.target.value === "") return;
      viewer.setIsovalue(event.target.valueAsNumber);
      const other = element(id === "isovalue" ? "isovalue-number" : "isovalue");
      other.value = Number(event.target.valueAsNumber.toPrecision(6));
      drawHistogram();
      wake();
    });
  }
  for (const id of SETTINGS) element(id).addEventListener("input", applySettings);
  element("save").onclick = save;
  element("share").onclick = share;
  element("message").querySelector("button").onclick = () => say(null);
  element("file").onchange = ({ target }) => target.files[0] && loadFile(target.files[0]);
  element("open-url").onsubmit = (event) => {
    event.preventDefault();
    loadUrl(element("url").value, "");
  };
  connectDrop();
  window.addEventListener("pointerdown", ({ pointerType }) => document.body.classList.toggle("touched", pointerType === "touch"));
  window.addEventListener("hashchange", () => openLink());
  new ResizeObserver(() => {
    applySettings();
    drawHistogram();
  }).observe(element("stage"));
}

function connectDrop() {
  const hasFiles = (event) => event.dataTransfer?.types.includes("Files");
  window.addEventListener("dragover", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    element("drop").hidden = false;
  });
  window.addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) element("drop").hidden = true;
  });
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    element("drop").hidden = true;
    const file = event.dataTransfer.files[0];
    if (file) loadFile(file);
  });
}

const loadFile = (file) => load(async () => fromFile(file), null, "");
const loadUrl = (url, fragment) => load((signal) => fromUrl(url, signal), url, fragment);

function openLink() {
  const infill = linkedInfill(location.hash);
  if (infill) {
    element("infill").value = infill;
    applySettings();
  }
  const volume = linkedVolume(location.hash) ?? BUNDLED;
  if (volume === address) {
    viewer.restore(location.hash);
    showIsovalue();
    drawHistogram();
    wake();
    return;
  }
  loadUrl(volume, volume === BUNDLED && !location.hash.includes("iso=") ? `iso=${BUNDLED_ISOVALUE}&${location.hash.slice(1)}` : location.hash);
}

const mebibytes = () => Math.round(2 ** element("budget").valueAsNumber);

function describeSettings() {
  const percent = (id) => `${Math.round(element(id).valueAsNumber * 100)} %`;
  const texts = [percent("scale"), `${mebibytes()} MiB`, percent("threshold")];
  document.querySelectorAll(".setting output").forEach((output, i) => (output.textContent = texts[i]));
}

function applySettings() {
  const [scale, threshold] = ["scale", "threshold"].map((id) => element(id).valueAsNumber);
  const pixels = (n) => Math.min(Math.max(Math.round(n * devicePixelRatio * scale), 1), MOST_PIXELS_PER_AXIS);
  const stage = element("stage");
  describeSettings();
  viewer?.set(pixels(stage.clientWidth), pixels(stage.clientHeight), mebibytes(), threshold,
    element("strategy").value === "sorted", element("infill").value);
  wake();
}

async function save() {
  const picture = await capture();
  const canvas = new OffscreenCanvas(picture.width(), picture.height());
  canvas.getContext("2d").putImageData(image(picture), 0, 0);
  picture.free();
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await canvas.convertToBlob());
  link.download = "isosurface.png";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

async function share() {
  const link = viewer.link(address === BUNDLED ? undefined : address);
  history.replaceState(null, "", `#${link}`);
  const button = element("share");
  try {
    await navigator.clipboard.writeText(location.href);
    button.textContent = "Copied";
  } catch {
    button.textContent = "In the address bar";
  }
  setTimeout(() => (button.textContent = "Copy link"), 2000);
}

// ---------------------------------------------------------------- start

async function start() {
  connect();
  if (!navigator.gpu) {
    element("state").textContent = "no WebGPU";
    const secure = window.isSecureContext ? "" : " Pages need https or localhost for it.";
    say(`This browser has no WebGPU, which this page draws with.${secure} Chrome and Edge from 113, Safari from 26 and Firefox from 141 have it on most systems.`);
    return;
  }
  try {
    ({ memory } = await init());
    viewer = await Viewer.create(element("canvas"), copies);
  } catch (error) {
    element("state").textContent = "no GPU";
    say(`This browser has WebGPU, but gives this page no GPU: ${reason(error)}`);
    return;
  }
  applySettings();
  openLink();
}

// For tests and the console.
window.page = {
  capture,
  measurements: () => ({
    shownAt,
    passes: [...viewer.passes()],
    peakBytes: viewer.peakBytes(),
    memory: memory.buffer.byteLength,
    adapter: viewer.adapter(),
  }),
};

start();
