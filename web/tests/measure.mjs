// Figures for docs/performance.md: `cargo xtask web --measure`.

import { finished, goTo, launch, loaded, open, reference, scenes, size } from "./browser.mjs";

const RUNS = 3;
/** Of `examples/reference.rs`: as many runs for every budget. */
const native = JSON.parse(reference("measured.json"));
const budgets = [...new Set(native.map(({ budget }) => budget))];

const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

/** Milliseconds until a share of the rays is finished. */
const timeTo = (share, passes) => passes.find(([, completeness]) => completeness >= share)[0];

function pairs(flat) {
  return Array.from({ length: flat.length / 2 }, (_, i) => [flat[2 * i], flat[2 * i + 1]]);
}

/** A visit: every scene's passes, and what the page says at the end. */
async function visit(browser, budget) {
  // The page reads its controls when it starts.
  const choose = `addEventListener("DOMContentLoaded", () => { document.getElementById("budget").value = ${Math.log2(budget)}; })`;
  const { page, context } = await open(browser, scenes[0].link, {}, choose);
  await loaded(page, "brain.zfp");
  const passes = [];
  for (const { link } of scenes) {
    await goTo(page, link);
    await finished(page);
    passes.push(pairs((await page.evaluate(() => window.page.measurements())).passes));
  }
  const { shownAt, peakBytes, memory, adapter } = await page.evaluate(() => window.page.measurements());
  const transferred = await page.evaluate(() =>
    performance.getEntriesByType("resource").reduce((sum, { encodedBodySize }) => sum + encodedBodySize, 0));
  await context.close();
  return { passes, shownAt, peakBytes, memory, adapter, transferred };
}

const browser = await launch();
const row = (...cells) => console.log(`| ${cells.join(" | ")} |`);
console.log(`pictures of ${size.join("x")} pixels, medians of ${RUNS} runs, Chromium ${browser.version()}\n`);
row("budget", "scene", "browser 85 %", "browser 100 %", "native 85 %", "native 100 %", "passes");
row("---:", "---", "---:", "---:", "---:", "---:", "---:");
const ms = (value) => `${Math.round(value)} ms`;
const starts = [];
for (const budget of budgets) {
  const visits = [];
  for (let run = 0; run < RUNS; run++) visits.push(await visit(browser, budget));
  const references = native.filter((measured) => measured.budget === budget);
  for (const [index, { name }] of scenes.entries()) {
    // Its time is that of loading, which the second table has.
    if (index === 0) continue;
    const cells = [visits.map(({ passes }) => passes[index]), references.map((measured) => measured.scenes[index].passes)]
      .flatMap((runs) => [0.85, 1].map((share) => ms(median(runs.map((passes) => timeTo(share, passes))))));
    row(`${budget} MiB`, name, ...cells, visits[0].passes[index].length);
  }
  starts.push({ budget, visits, references });
}
console.log();
row("budget", "first picture, browser", "native", "peak GPU bytes, browser", "native", "WebAssembly memory", "transferred, not zipped");
row("---:", "---:", "---:", "---:", "---:", "---:", "---:");
for (const { budget, visits, references } of starts) {
  const most = (values) => Math.max(...values);
  row(`${budget} MiB`, ms(median(visits.map(({ shownAt }) => shownAt))), ms(median(references.map(({ first_ms }) => first_ms))),
    most(visits.map(({ peakBytes }) => peakBytes)), most(references.map(({ peak_bytes }) => peak_bytes)),
    most(visits.map(({ memory }) => memory)), visits[0].transferred);
}
await browser.close();
