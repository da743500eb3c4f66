// The colour that a city's surface has, from its coarsest node files alone: what a viewer is
// expected to show.
'use strict';

const COMPONENTS = {
    5121: [Uint8Array, 255],
    5122: [Int16Array, 32767],
    5123: [Uint16Array, 65535],
    5125: [Uint32Array, 1],
    5126: [Float32Array, 1],
};
const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

/** The numbers of an accessor, element after element; normalized ones within 0 to 1. */
function elements(glb, index) {
    const { json, views } = glb;
    const { bufferView, byteOffset = 0, componentType, normalized, count, type } = json.accessors[index];
    const view = json.bufferViews[bufferView];
    const [Kind, most] = COMPONENTS[componentType];
    const width = WIDTHS[type];
    const stride = (view.byteStride ?? width * Kind.BYTES_PER_ELEMENT) / Kind.BYTES_PER_ELEMENT;
    const raw = new Kind(views[bufferView].slice(byteOffset, byteOffset + count * stride * Kind.BYTES_PER_ELEMENT));
    const out = new Float64Array(count * width);
    for (let i = 0; i < count; i++) {
        for (let c = 0; c < width; c++) {
            out[i * width + c] = raw[i * stride + c] / (normalized ? most : 1);
        }
    }
    return out;
}

/** JSON and buffer views of a GLB, decompressed. */
async function parse(bytes) {
    const words = new DataView(bytes);
    const length = words.getUint32(12, true);
    const json = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 20, length)));
    const bin = bytes.slice(20 + length + 8);
    const part = ({ byteOffset = 0, byteLength }) => bin.slice(byteOffset, byteOffset + byteLength);
    const view = async (view) => {
        const packed = view.extensions?.EXT_meshopt_compression;
        if (!packed) {
            return part(view);
        }
        const { MeshoptDecoder } = await import('/meshoptimizer/index.js');
        await MeshoptDecoder.ready;
        const { count, byteStride, mode, filter } = packed;
        const unpacked = new Uint8Array(count * byteStride);
        MeshoptDecoder.decodeGltfBuffer(unpacked, count, byteStride, new Uint8Array(part(packed)), mode, filter);
        return unpacked.buffer;
    };
    return { json, views: await Promise.all((json.bufferViews ?? []).map(view)) };
}

async function pixels(glb, image, base) {
    const { bufferView, mimeType, uri } = image;
    let blob;
    if (uri === undefined) {
        blob = new Blob([glb.views[bufferView]], { type: mimeType });
    } else {
        blob = await (await fetch(new URL(uri, base))).blob();
    }
    const picture = await createImageBitmap(blob);
    const canvas = new OffscreenCanvas(picture.width, picture.height);
    const context = canvas.getContext('2d', { willReadFrequently: true });
    context.drawImage(picture, 0, 0);
    return context.getImageData(0, 0, picture.width, picture.height);
}

const toSrgb = (linear) =>
    255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);

/**
 * Mean sRGB colour of a file's surface, seen from above and from all sides alike, and the share of
 * it that has a picture: sums, to be divided by `area`.
 */
async function surfaceColours(url) {
    const glb = await parse(await (await fetch(url)).arrayBuffer());
    const { json } = glb;
    const sum = { area: 0, textured: 0, rgb: [0, 0, 0] };
    // Quantised positions are in steps, and those of files too large for them are not.
    const scale = Math.hypot(...(json.nodes?.[0]?.matrix?.slice(0, 3) ?? [1]));
    const pictures = await Promise.all((json.images ?? []).map((image) => pixels(glb, image, url)));
    for (const { attributes, indices, material } of json.meshes?.[0]?.primitives ?? []) {
        const positions = elements(glb, attributes.POSITION);
        const corners = elements(glb, indices);
        const { baseColorFactor: factor = [1, 1, 1, 1], baseColorTexture } =
            json.materials[material].pbrMetallicRoughness;
        const picture = baseColorTexture && pictures[json.textures[baseColorTexture.index].source];
        const texcoords = picture && elements(glb, attributes.TEXCOORD_0);
        const colours = attributes.COLOR_0 !== undefined && elements(glb, attributes.COLOR_0);
        for (let t = 0; t < corners.length; t += 3) {
            const point = (k) => positions.subarray(3 * corners[t + k], 3 * corners[t + k] + 3);
            const [a, b, c] = [point(0), point(1), point(2)];
            const side = (to, axis) => to[axis] - a[axis];
            const cross = (i, j) => side(b, i) * side(c, j) - side(b, j) * side(c, i);
            const area = (scale * scale * Math.hypot(cross(1, 2), cross(2, 0), cross(0, 1))) / 2;
            const mean = (values, width, channel) =>
                [0, 1, 2].reduce((s, k) => s + values[width * corners[t + k] + channel], 0) / 3;
            let rgb = factor.slice(0, 3);
            if (colours) {
                rgb = rgb.map((value, channel) => value * mean(colours, 4, channel));
            }
            rgb = rgb.map(toSrgb);
            if (picture) {
                const wrap = (value) => value - Math.floor(value);
                const x = Math.min(picture.width - 1, Math.floor(wrap(mean(texcoords, 2, 0)) * picture.width));
                const y = Math.min(picture.height - 1, Math.floor(wrap(mean(texcoords, 2, 1)) * picture.height));
                const texel = 4 * (y * picture.width + x);
                rgb = rgb.map((value, channel) => (value * picture.data[texel + channel]) / 255);
                sum.textured += area;
            }
            sum.area += area;
            rgb.forEach((value, channel) => { sum.rgb[channel] += value * area; });
        }
    }
    return sum;
}

/** The contents nearest to the root, of a tileset and those that it refers to. */
async function coarsest(url) {
    const { root } = await (await fetch(url)).json();
    const found = [];
    const descend = async (tile) => {
        const content = tile.content && new URL(tile.content.uri, url);
        if (content?.pathname.endsWith('.json')) {
            found.push(...(await coarsest(content)));
        } else if (content) {
            found.push(content);
        } else {
            for (const child of tile.children ?? []) {
                await descend(child);
            }
        }
    };
    await descend(root);
    return found;
}

/** Mean sRGB colour of the city's surface and the share of it that has a picture. */
window.expectedColour = async (folder) => {
    const total = { area: 0, textured: 0, rgb: [0, 0, 0] };
    for (const url of await coarsest(new URL(`${folder}tileset.json`, location.href))) {
        const { area, textured, rgb } = await surfaceColours(url);
        total.area += area;
        total.textured += textured;
        rgb.forEach((value, channel) => { total.rgb[channel] += value; });
    }
    const { area, textured, rgb } = total;
    return area > 0 && { rgb: rgb.map((value) => value / area), textured: textured / area };
};
