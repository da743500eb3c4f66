// Compares the leaves of results with their sources in CesiumJS; see scripts/view-compare.
'use strict';
const fs = require('fs');
const path = require('path');
const { chromium } = require('playwright-core');
const { serve } = require('./server.js');
const { FLAGS, watch } = require('./browser.js');

const SIZE = { width: 960, height: 640 };
/**
 * A pixel differs if a channel is this far outside of what the source has in the 3 × 3 pixels around
 * it: a silhouette that is moved by a pixel is no difference, a line that the source does not have is.
 */
const MOST_DIFFERENCE = 32;

/** The canvas: runs in the page. */
function pixels() {
    const canvas = document.querySelector('.cesium-widget canvas');
    const copy = document.createElement('canvas');
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext('2d', { willReadFrequently: true });
    context.drawImage(canvas, 0, 0);
    return context.getImageData(0, 0, copy.width, copy.height);
}

/**
 * Counts pixels of three images of one view: of the leaves, of the source, and of the leaves in a
 * colour for each node. Runs in the page.
 */
function count(mostDifference) {
    const { leaves, source, nodes } = window.kept;
    const { width, height } = leaves;
    const NONE = -1;
    const id = new Int32Array(width * height);
    const isBackground = (rgb) => rgb.every((value, c) => Math.abs(value - window.hlod.background[c]) <= 1);
    for (let i = 0; i < id.length; i++) {
        const rgb = [0, 1, 2].map((c) => nodes.data[4 * i + c]);
        id[i] = isBackground(rgb) ? NONE : rgb.reduce((sum, value) => 256 * sum + value, 0);
    }
    const found = { border: 0, atBorder: 0, inside: 0, atInside: 0, places: [] };
    for (let y = 1; y + 1 < height; y++) {
        for (let x = 1; x + 1 < width; x++) {
            const i = y * width + x;
            if (id[i] === NONE) {
                continue;
            }
            const around = [-1, 0, 1].flatMap((v) => [-1, 0, 1].map((u) => i + v * width + u));
            const isBorder = around.some((j) => id[j] !== NONE && id[j] !== id[i]);
            const differs = [0, 1, 2].some((c) => {
                const values = around.map((j) => source.data[4 * j + c]);
                const value = leaves.data[4 * i + c];
                return value > Math.max(...values) + mostDifference || value < Math.min(...values) - mostDifference;
            });
            found[isBorder ? 'border' : 'inside']++;
            if (differs) {
                found[isBorder ? 'atBorder' : 'atInside']++;
                found.places.push([x, y]);
            }
        }
    }
    return found;
}

const share = (part, whole) => (whole > 0 ? (1e4 * part) / whole : 0).toFixed(2);

/** Compares one result with its source; returns the number of faults. */
async function compare(browser, url, source, folder, { shots, views, distance, limit }) {
    const faults = [];
    const page = await browser.newPage({ viewport: SIZE });
    await watch(page, faults);
    await page.goto(`${url}&check`);
    const leaves = await page.evaluate((source) => window.hlod.addSource(source), source);
    const sum = { border: 0, atBorder: 0, inside: 0, atInside: 0 };
    for (let view = 0; view < views; view++) {
        const name = `${path.basename(path.resolve(folder))}-${view}`;
        for (const what of ['leaves', 'source', 'nodes']) {
            await page.evaluate((asked) => window.hlod.lookAtBorder(asked), { what, view, views, distance });
            await page.evaluate(`(window.kept ??= {}).${what} = (${pixels})()`);
            if (shots) {
                await page.screenshot({ path: path.join(shots, `${name}-${what}.png`) });
            }
        }
        const found = await page.evaluate(count, MOST_DIFFERENCE);
        if (shots) {
            fs.writeFileSync(path.join(shots, `${name}.json`), JSON.stringify(found));
        }
        Object.keys(sum).forEach((key) => { sum[key] += found[key]; });
    }
    faults.push(...(await page.evaluate(() => window.hlod.failures)));
    await page.close();
    const off = share(sum.atBorder, sum.border);
    if (!(sum.border > 0)) {
        faults.push('no border of two nodes is in view');
    }
    if (!(Number(off) <= limit)) {
        faults.push(`${off} of 10,000 pixels at borders differ from the source, expected ${limit} or fewer`);
    }
    console.log(`${folder}: ${leaves} leaves, ${views} views`);
    console.log(`  pixels that differ from the source: ${sum.atBorder} of ${sum.border} at borders of nodes `
        + `(${off} of 10,000), ${sum.atInside} of ${sum.inside} elsewhere (${share(sum.atInside, sum.inside)} of 10,000)`);
    faults.forEach((fault) => console.log(`  FAULT ${fault}`));
    return faults.length;
}

async function main(rest) {
    const options = { views: 4, distance: 2, limit: 1 };
    while (rest[0]?.startsWith('--')) {
        const [name, value] = rest.splice(0, 2);
        options[name.slice(2)] = name === '--shots' ? value : Number(value);
    }
    if (options.shots) {
        fs.mkdirSync(options.shots, { recursive: true });
    }
    const pairs = [];
    while (rest.length > 0) {
        pairs.push(rest.splice(0, 2));
    }
    const folders = pairs.flatMap(([out, source]) => [out, path.dirname(path.resolve(source))]);
    const { server, page } = await serve(folders);
    const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: FLAGS });
    let faults = 0;
    try {
        for (const [number, [out, source]] of pairs.entries()) {
            const file = `/out/${2 * number + 1}/${encodeURIComponent(path.basename(source))}`;
            faults += await compare(browser, page(2 * number), file, out, options);
        }
    } finally {
        await browser.close();
        server.close();
    }
    console.log(`${pairs.length} results compared, ${faults} faults`);
    process.exitCode = faults > 0 ? 1 : 0;
}

main(process.argv.slice(2)).catch((error) => {
    console.error(`view-compare: ${error.message}`);
    process.exitCode = 1;
});
