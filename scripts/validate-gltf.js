// Validates glTF files in parallel worker threads; see scripts/validate-gltf.
'use strict';
const fs = require('fs');
const os = require('os');
const path = require('path');
const { Worker, isMainThread, parentPort } = require('worker_threads');

// The validator's severities.
const ERROR = 0;
const WARNING = 1;

/** All .glb and .gltf files at or below a path, in the order of their names. */
function modelsBelow(root) {
    if (!fs.statSync(root).isDirectory()) {
        return [root];
    }
    return fs
        .readdirSync(root, { withFileTypes: true })
        .sort((a, b) => (a.name < b.name ? -1 : 1))
        .flatMap((entry) => {
            const file = path.join(root, entry.name);
            if (entry.isDirectory()) {
                return modelsBelow(file);
            }
            return /\.(glb|gltf)$/i.test(entry.name) ? [file] : [];
        });
}

/** The errors and warnings of one file. */
async function validate(file) {
    const { validateBytes } = require('gltf-validator');
    const report = await validateBytes(new Uint8Array(fs.readFileSync(file)), {
        uri: path.basename(file),
        maxIssues: 100,
        externalResourceFunction: async (uri) => {
            const resource = path.resolve(path.dirname(file), decodeURIComponent(uri));
            return new Uint8Array(await fs.promises.readFile(resource));
        },
    });
    const { messages, numErrors, numWarnings } = report.issues;
    const kept = messages.filter(({ severity }) => severity === ERROR || severity === WARNING);
    return { messages: kept, numErrors, numWarnings };
}

/** Takes file names one after another and answers each with its result. */
function work() {
    parentPort.on('message', async (file) => {
        const result = await validate(file).catch((error) => ({
            messages: [{ severity: ERROR, code: 'UNREADABLE', message: String(error.message ?? error) }],
            numErrors: 1,
            numWarnings: 0,
        }));
        parentPort.postMessage({ file, ...result });
    });
}

/** Validates all files and returns the results in the files' order. */
function validateAll(files) {
    const results = new Map();
    let next = 0;
    const runWorker = () =>
        new Promise((resolve, reject) => {
            const worker = new Worker(__filename);
            const proceed = () => {
                if (next < files.length) {
                    worker.postMessage(files[next++]);
                } else {
                    worker.terminate().then(resolve, reject);
                }
            };
            worker.on('error', reject);
            worker.on('message', (result) => {
                results.set(result.file, result);
                proceed();
            });
            proceed();
        });
    const count = Math.min(os.cpus().length, files.length);
    return Promise.all(Array.from({ length: count }, runWorker)).then(() =>
        files.map((file) => results.get(file)),
    );
}

async function main(roots) {
    const files = [...new Set(roots.flatMap(modelsBelow))];
    if (files.length === 0) {
        throw new Error(`no .glb or .gltf file in ${roots.join(', ')}`);
    }
    const results = await validateAll(files);
    const warnings = new Map();
    let errors = 0;
    for (const { file, messages, numErrors } of results) {
        errors += numErrors;
        for (const { severity, code, message, pointer } of messages) {
            if (severity === ERROR) {
                console.log(`${file}: ${code} ${pointer ?? ''}: ${message}`);
            } else {
                warnings.set(code, (warnings.get(code) ?? 0) + 1);
            }
        }
    }
    for (const [code, count] of [...warnings].sort()) {
        console.log(`warning ${code}: ${count} times`);
    }
    const invalid = results.filter(({ numErrors }) => numErrors > 0).length;
    console.log(`${files.length} files validated, ${invalid} with errors, ${errors} errors`);
    process.exitCode = errors > 0 ? 1 : 0;
}

if (isMainThread) {
    main(process.argv.slice(2)).catch((error) => {
        console.error(`validate-gltf: ${error.message}`);
        process.exitCode = 1;
    });
} else {
    work();
}
