// Serves CesiumJS, the page and result folders on loopback only; see scripts/view.
'use strict';
const fs = require('fs');
const http = require('http');
const path = require('path');

const TYPES = {
    '.css': 'text/css',
    '.glb': 'model/gltf-binary',
    '.html': 'text/html; charset=utf-8',
    '.jpg': 'image/jpeg',
    '.js': 'text/javascript',
    '.json': 'application/json',
    '.mjs': 'text/javascript',
    '.png': 'image/png',
    '.svg': 'image/svg+xml',
    '.wasm': 'application/wasm',
    '.xml': 'application/xml',
};

/** Where CesiumJS was installed to: its built form. */
function cesiumRoot() {
    return path.join(path.dirname(require.resolve('cesium/package.json')), 'Build', 'Cesium');
}

/** The file below a root that a URL's path names; nothing outside of the root. */
function fileBelow(root, relative) {
    const file = path.resolve(root, '.' + path.posix.normalize('/' + relative));
    return file.startsWith(path.resolve(root) + path.sep) ? file : undefined;
}

/**
 * Serves until the returned server is closed. Folders appear as /out/0/, /out/1/ and so on.
 * Resolves to the server and the address of its page.
 */
function serve(folders, port = 0) {
    const roots = new Map([
        ['page', __dirname],
        ['cesium', cesiumRoot()],
        // CesiumJS depends on it.
        ['meshoptimizer', path.dirname(require.resolve('meshoptimizer'))],
    ]);
    folders.forEach((folder, number) => roots.set(`out/${number}`, path.resolve(folder)));
    const answer = (request, response) => {
        const url = decodeURIComponent(new URL(request.url, 'http://localhost').pathname).slice(1);
        const prefix = [...roots.keys()].find((key) => url.startsWith(key + '/'));
        const file = prefix && fileBelow(roots.get(prefix), url.slice(prefix.length + 1));
        if (request.method !== 'GET' || !file || !fs.existsSync(file) || !fs.statSync(file).isFile()) {
            response.writeHead(url === 'favicon.ico' ? 204 : 404).end();
            return;
        }
        response.writeHead(200, {
            'Content-Type': TYPES[path.extname(file)] ?? 'application/octet-stream',
            'Content-Length': fs.statSync(file).size,
            'Cache-Control': 'no-store',
        });
        fs.createReadStream(file).pipe(response);
    };
    return new Promise((resolve, reject) => {
        const server = http.createServer((request, response) => {
            try {
                answer(request, response);
            } catch {
                response.writeHead(400).end();
            }
        });
        server.on('error', reject);
        server.listen(port, '127.0.0.1', () => {
            const base = `http://127.0.0.1:${server.address().port}`;
            resolve({ server, page: (number) => `${base}/page/page.html?out=/out/${number}/` });
        });
    });
}

module.exports = { serve };

if (require.main === module) {
    const [folder, port] = process.argv.slice(2);
    serve([folder], Number(port ?? 0)).then(({ page }) => {
        console.log(page(0));
    }).catch((error) => {
        console.error(`view: ${error.message}`);
        process.exit(1);
    });
}
