// Looks at results in CesiumJS and checks what is seen; see scripts/view-check.
'use strict';
const fs = require('fs');
const path = require('path');
const { chromium } = require('playwright-core');
const { FLAGS, watch } = require('./browser.js');
const { serve } = require('./server.js');

const SIZE = { width: 960, height: 640 };
/** The whole, and a part of it. */
const FAR = { radii: 2.4 };
/** One pixel of error: small cities have small errors on all levels. */
const NEAR = { radii: 0.35, pitch: -30, error: 1 };
/** Pixels of error that no node's level has and every group of nodes: the coarsest that is drawn. */
const COARSE = 200;
/** Pixels that must show the city, of all: of one that fills so many from far, and of one whose houses
 * or roads lie far apart. */
const LEAST_SHARE = { dense: 0.04, near: 0.15, sparse: 0.005 };
/** Difference of the shares that red, green and blue have in the mean colour. Walls in the shade count less
 * than roofs where surfaces are lit. */
const MOST_HUE = { textured: 0.05, lit: 0.1 };
/** Brightness of the picture over that of the textures; lit surfaces may be in the shade. */
const BRIGHTNESS = { textured: [0.6, 1.5], lit: [0.2, 1.5] };

/** What stands in the picture: runs in the page. */
function measure() {
    const canvas = document.querySelector('.cesium-widget canvas');
    const copy = document.createElement('canvas');
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext('2d', { willReadFrequently: true });
    context.drawImage(canvas, 0, 0);
    const { data, width, height } = context.getImageData(0, 0, copy.width, copy.height);
    const [r, g, b] = window.hlod.background;
    const isCity = (i) => Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) > 24;
    const sum = [0, 0, 0];
    let [pixels, edges, pairs] = [0, 0, 0];
    for (let y = 0; y < height; y++) {
        for (let x = 0; x < width; x++) {
            const i = 4 * (y * width + x);
            if (!isCity(i)) {
                continue;
            }
            pixels++;
            for (const channel of [0, 1, 2]) {
                sum[channel] += data[i + channel];
            }
            for (const j of [x + 1 < width && i + 4, y + 1 < height && i + 4 * width]) {
                if (j && isCity(j)) {
                    pairs++;
                    edges += Math.abs(data[i + 1] - data[j + 1]);
                }
            }
        }
    }
    return { share: pixels / (width * height), rgb: sum.map((s) => s / pixels), contrast: edges / pairs };
}

const total = (rgb) => rgb.reduce((sum, value) => sum + value, 0);
const rounded = (rgb) => rgb.map(Math.round).join(' ');

/** A picture as a person sees it, for documentation. */
async function picture(browser, url, file) {
    const page = await browser.newPage({ viewport: { width: 1000, height: 560 } });
    await page.goto(url);
    await page.evaluate(() => window.hlod.look({ radii: 1.15, pitch: -28 }));
    await page.waitForTimeout(1000);
    await page.screenshot({ path: file, type: 'jpeg', quality: 80 });
    await page.close();
}

/** Faults of one result. */
async function check(browser, url, folder, shots) {
    const faults = [];
    const page = await browser.newPage({ viewport: SIZE });
    await watch(page, faults);
    const begin = performance.now();
    await page.goto(`${url}&check`);
    const place = await page.evaluate(() => window.hlod.place());
    const look = async (name, view) => {
        const shown = await page.evaluate((view) => window.hlod.look(view), view);
        const seen = await page.evaluate(measure);
        if (shots) {
            const file = path.join(shots, `${path.basename(path.resolve(folder))}-${name}.png`);
            await page.screenshot({ path: file });
        }
        return { ...shown, ...seen };
    };
    const far = await look('far', FAR);
    const seconds = (performance.now() - begin) / 1000;
    const coarse = await look('near-coarse', { ...NEAR, error: COARSE });
    const near = await look('near', NEAR);
    await page.addScriptTag({ url: 'colours.js' });
    const folderUrl = new URL(url).searchParams.get('out');
    const expected = await page.evaluate((out) => window.expectedColour(out), folderUrl);
    faults.push(...(await page.evaluate(() => window.hlod.failures)));
    await page.close();

    const { dense, near: close, sparse } = LEAST_SHARE;
    for (const [name, { share }, least] of [['far', far, sparse], ['near', near, far.share >= dense ? close : sparse]]) {
        if (!(share >= least)) {
            faults.push(`${name}: ${(share * 100).toFixed(2)} % of the picture show the city, expected ${least * 100} or more`);
        }
    }
    if (expected) {
        const hue = Math.max(...[0, 1, 2].map((channel) =>
            Math.abs(far.rgb[channel] / total(far.rgb) - expected.rgb[channel] / total(expected.rgb))));
        const brightness = total(far.rgb) / total(expected.rgb);
        const kind = expected.textured > 0.9 ? 'textured' : 'lit';
        const [least, most] = BRIGHTNESS[kind];
        if (!(hue <= MOST_HUE[kind] && brightness >= least && brightness <= most)) {
            faults.push(`far: mean colour ${rounded(far.rgb)}, expected about ${rounded(expected.rgb)} of the textures`);
        }
    }
    // A city whose roots are leaves has one level.
    if (coarse.coarsest > 0) {
        if (!(near.error < coarse.error)) {
            faults.push(`near: tiles shown have a mean error of ${near.error} m, the coarsest level ${coarse.error} m`);
        }
        // Where faces have one colour each, coarse ones may differ as much as fine ones.
        const finer = expected.textured > 0.5 ? near.contrast > coarse.contrast : near.triangles > coarse.triangles;
        if (!finer) {
            faults.push(`near: contrast ${near.contrast} and ${near.triangles} triangles, the coarsest level has ${coarse.contrast} and ${coarse.triangles}`);
        }
    }
    const where = place ? `${place[1].toFixed(5)}° N ${place[0].toFixed(5)}° E, ${place[2].toFixed(0)} m` : 'without a place';
    const view = ({ tiles, triangles, share }) => `${tiles} tiles, ${triangles} triangles, ${(share * 100).toFixed(0)} % of the picture`;
    console.log(`${folder}: ${where}`);
    console.log(`  far:  ${view(far)}, colour ${rounded(far.rgb)}, textures ${expected ? rounded(expected.rgb) : 'none'}, ${seconds.toFixed(1)} s`);
    console.log(`  near: ${view(near)}, contrast ${near.contrast.toFixed(2)} (coarsest level ${coarse.contrast.toFixed(2)})`);
    faults.forEach((fault) => console.log(`  FAULT ${fault}`));
    return faults.length;
}

async function main(folders) {
    const kept = {};
    while (folders[0] === '--shots' || folders[0] === '--pictures') {
        kept[folders[0]] = folders[1];
        fs.mkdirSync(folders[1], { recursive: true });
        folders = folders.slice(2);
    }
    for (const folder of folders) {
        if (!fs.existsSync(path.join(folder, 'tileset.json'))) {
            throw new Error(`${folder} has no tileset.json; build it again`);
        }
    }
    const { server, page } = await serve(folders);
    const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: FLAGS });
    let faults = 0;
    try {
        for (const [number, folder] of folders.entries()) {
            faults += await check(browser, page(number), folder, kept['--shots']);
            if (kept['--pictures']) {
                const name = `${path.basename(path.resolve(folder))}.jpg`;
                await picture(browser, page(number), path.join(kept['--pictures'], name));
            }
        }
    } finally {
        await browser.close();
        server.close();
    }
    console.log(`${folders.length} results looked at, ${faults} faults`);
    process.exitCode = faults > 0 ? 1 : 0;
}

main(process.argv.slice(2)).catch((error) => {
    console.error(`view-check: ${error.message}`);
    process.exitCode = 1;
});
