// What checks in a headless Chromium have in common.
'use strict';

/** WebGL on the processor, and no talk with anybody outside. */
const FLAGS = [
    '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
    '--ignore-gpu-blocklist', '--disable-quic', '--no-first-run', '--disable-background-networking',
    '--disable-component-update', '--disable-sync', '--hide-scrollbars',
];

/** Adds whatever goes wrong in a page to `faults`, and refuses requests to other machines. */
async function watch(page, faults) {
    page.on('console', (message) => {
        if (message.type() === 'error') {
            faults.push(`console: ${message.text()}`);
        }
    });
    page.on('pageerror', (error) => faults.push(`page: ${error.message}`));
    page.on('requestfailed', (request) => {
        const why = request.failure()?.errorText;
        // Viewers cancel requests for what a camera that moved on no longer needs.
        if (why !== 'net::ERR_ABORTED') {
            faults.push(`request: ${request.url()} ${why}`);
        }
    });
    page.on('response', (response) => {
        if (response.status() >= 400) {
            faults.push(`request: ${response.url()} ${response.status()}`);
        }
    });
    await page.route((to) => to.hostname !== '127.0.0.1' && !['data:', 'blob:'].includes(to.protocol),
        (route) => { faults.push(`asks for ${route.request().url()}`); return route.abort(); });
}

module.exports = { FLAGS, watch };
