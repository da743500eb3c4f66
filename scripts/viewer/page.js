// Shows the tileset of ?out=FOLDER/ in CesiumJS. With &check the picture holds the city and a plain
// background alone, so that it can be compared; scripts/view-check drives it through `window.hlod`.
'use strict';

const question = new URLSearchParams(location.search);
const folder = question.get('out');
const checked = question.has('check');

/** A plain colour that no city has: magenta. */
const BACKGROUND = [255, 0, 255];

const viewer = new Cesium.Viewer('view', {
    baseLayer: false,
    baseLayerPicker: false,
    geocoder: false,
    homeButton: false,
    sceneModePicker: false,
    navigationHelpButton: false,
    animation: false,
    timeline: false,
    fullscreenButton: false,
    infoBox: false,
    selectionIndicator: false,
    skyBox: false,
    skyAtmosphere: false,
    msaaSamples: checked ? 1 : 4,
    contextOptions: { webgl: { preserveDrawingBuffer: true } },
});
const { scene, camera } = viewer;
scene.fog.enabled = false;
scene.highDynamicRange = false;
scene.backgroundColor = checked
    ? Cesium.Color.fromBytes(...BACKGROUND)
    : Cesium.Color.fromCssColorString('#9ec7e8');
scene.light = new Cesium.DirectionalLight({ direction: new Cesium.Cartesian3(0, 0, -1) });
// Errors of a tile are shown where the tester looks for them.
const failures = [];

/** Puts a model without a place on the equator, its middle on the ground. */
function groundless(tileset) {
    const centre = tileset.root.boundingVolume.boundingSphere.center;
    const place = Cesium.Transforms.eastNorthUpToFixedFrame(Cesium.Cartesian3.fromDegrees(0, 0));
    const shift = Cesium.Matrix4.fromTranslation(Cesium.Cartesian3.negate(centre, centre.clone()));
    return Cesium.Matrix4.multiply(place, shift, new Cesium.Matrix4());
}

async function open() {
    const root = (await (await fetch(`${folder}tileset.json`)).json()).root;
    const tileset = await Cesium.Cesium3DTileset.fromUrl(`${folder}tileset.json`, {
        skipLevelOfDetail: false,
        showCreditsOnScreen: false,
    });
    const placed = root.transform !== undefined;
    if (!placed) {
        tileset.modelMatrix = groundless(tileset);
    }
    tileset.tileFailed.addEventListener(({ url, message }) => failures.push(`${url}: ${message}`));
    scene.primitives.add(tileset);
    scene.globe.show = placed && !checked;
    if (scene.globe.show) {
        scene.globe.baseColor = Cesium.Color.fromCssColorString('#a9b79a');
        const earth = Cesium.buildModuleUrl('Assets/Textures/NaturalEarthII');
        Cesium.TileMapServiceImageryProvider.fromUrl(earth)
            .then((provider) => viewer.imageryLayers.addImageryProvider(provider));
    }
    // Light from over the shoulder of someone who looks north-west.
    const { center } = tileset.boundingSphere;
    const axes = Cesium.Transforms.eastNorthUpToFixedFrame(center);
    const beam = new Cesium.Cartesian3(-0.5, 0.6, -0.9);
    const direction = Cesium.Matrix4.multiplyByPointAsVector(axes, beam, new Cesium.Cartesian3());
    scene.light.direction = Cesium.Cartesian3.normalize(direction, direction);
    const cartographic = Cesium.Cartographic.fromCartesian(center);
    return { tileset, placed, place: cartographic };
}

const opened = open();

/** Draws frames until all is loaded that the view needs; the tiles shown, with their contents. */
async function settled(tileset) {
    const shown = new Map();
    const note = (tile) => shown.set(tile, tile.content);
    const begin = performance.now();
    for (let steady = 0, frames = 0; steady < 4; frames++) {
        if (performance.now() - begin > 120e3) {
            failures.push(`still loading after ${frames} frames`);
            break;
        }
        await new Promise(requestAnimationFrame);
        shown.clear();
        tileset.tileVisible.addEventListener(note);
        scene.render();
        tileset.tileVisible.removeEventListener(note);
        steady = tileset.tilesLoaded ? steady + 1 : 0;
    }
    return shown;
}

function facts(tileset, shown) {
    const errors = [...shown.keys()].map((tile) => tile.geometricError);
    return {
        tiles: shown.size,
        triangles: [...shown.values()].reduce((sum, content) => sum + content.trianglesLength, 0),
        bytes: tileset.totalMemoryUsageInBytes,
        coarsest: Math.max(...errors),
        error: errors.reduce((sum, error) => sum + error, 0) / errors.length,
    };
}

/** Draws a tileset by its colours alone, without light; white with `u_white` 1. */
function unlit(tileset) {
    tileset.customShader = new Cesium.CustomShader({
        lightingModel: Cesium.LightingModel.UNLIT,
        uniforms: { u_white: { type: Cesium.UniformType.FLOAT, value: 0 } },
        fragmentShaderText: `void fragmentMain(FragmentInput fsInput, inout czm_modelMaterial material) {
            material.diffuse = mix(material.diffuse, vec3(1.0), u_white);
        }`,
    });
}

/** The bytes of a GLB whose textures are filtered as those of results are. */
async function withMipmaps(url) {
    const glb = await (await fetch(url)).arrayBuffer();
    const words = new DataView(glb);
    const length = words.getUint32(12, true);
    const json = JSON.parse(new TextDecoder().decode(new Uint8Array(glb, 20, length)));
    const [LINEAR, LINEAR_MIPMAP_LINEAR] = [9729, 9987];
    json.samplers ??= [];
    for (const texture of json.textures ?? []) {
        texture.sampler ??= json.samplers.push({}) - 1;
    }
    json.samplers.forEach((sampler) => {
        Object.assign(sampler, { magFilter: LINEAR, minFilter: LINEAR_MIPMAP_LINEAR });
    });
    const text = new TextEncoder().encode(JSON.stringify(json));
    const padded = new Uint8Array(4 * Math.ceil(text.length / 4)).fill(0x20);
    padded.set(text);
    const head = new Uint32Array([0x46546c67, 2, 20 + padded.length + glb.byteLength - 20 - length, padded.length, 0x4e4f534a]);
    return new Blob([head, padded, glb.slice(20 + length)]);
}

/** The boxes of the tiles of a tileset's JSON that have no children. */
const leafBoxes = ({ children, boundingVolume }) =>
    (children?.length ? children.flatMap(leafBoxes) : [boundingVolume.box]);

/** The source of the result and the boxes of its leaves, where the two are compared. */
let source;
let boxes;

/** Everything that a tester asks for. */
window.hlod = {
    /** Where the middle is: longitude and latitude in degrees, height in metres. */
    async place() {
        const { placed, place } = await opened;
        const degrees = Cesium.Math.toDegrees;
        return placed && [degrees(place.longitude), degrees(place.latitude), place.height];
    },

    /**
     * Looks at the middle of the city from a distance in its radii, waits until all is loaded that
     * the view needs, and says what is shown.
     */
    async look({ radii, heading = -30, pitch = -35, error = 16, east = 0, north = 0 }) {
        const { tileset } = await opened;
        tileset.maximumScreenSpaceError = error;
        const { center, radius } = tileset.boundingSphere;
        const axes = Cesium.Transforms.eastNorthUpToFixedFrame(center);
        const aside = new Cesium.Cartesian3(east * radius, north * radius, 0);
        const target = Cesium.Matrix4.multiplyByPoint(axes, aside, new Cesium.Cartesian3());
        const view = new Cesium.HeadingPitchRange(
            Cesium.Math.toRadians(heading), Cesium.Math.toRadians(pitch), radii * radius);
        camera.lookAt(target, view);
        camera.lookAtTransform(Cesium.Matrix4.IDENTITY);
        const begin = performance.now();
        const shown = await settled(tileset);
        return { ...facts(tileset, shown), milliseconds: performance.now() - begin };
    },

    /** Adds the source of the result, a GLB, to be compared with the leaves, whose number it returns. */
    async addSource(url) {
        const { tileset } = await opened;
        const { root } = await (await fetch(`${folder}tileset.json`)).json();
        const content = { uri: URL.createObjectURL(await withMipmaps(url)) };
        const json = {
            asset: { version: '1.1' },
            geometricError: 1e9,
            root: { boundingVolume: root.boundingVolume, transform: root.transform, geometricError: 0, refine: 'REPLACE', content },
        };
        source = await Cesium.Cesium3DTileset.fromUrl(URL.createObjectURL(new Blob([JSON.stringify(json)])));
        source.modelMatrix = tileset.modelMatrix;
        scene.primitives.add(source);
        source.tileFailed.addEventListener(({ url, message }) => failures.push(`${url}: ${message}`));
        for (const each of [tileset, source]) {
            each.maximumScreenSpaceError = 1e-9;
            // Nothing coarse far away, beside the middle of the view, or for a while.
            each.dynamicScreenSpaceError = false;
            each.foveatedScreenSpaceError = false;
            each.cacheBytes = 4 * 2 ** 30;
            unlit(each);
        }
        boxes = leafBoxes(root);
        return boxes.length;
    },

    /**
     * Shows the leaves, the source, or the leaves with a colour for each node, at one of several views of
     * borders between leaves. `distance` is from the middle of a side of a leaf's box, in half diagonals
     * of that box.
     */
    async lookAtBorder({ what, view, views, distance }) {
        const { tileset } = await opened;
        // Middle and three half axes.
        const box = boxes[Math.floor((view * boxes.length) / views)];
        const side = 3 + 3 * (view % 2);
        const target = Cesium.Cartesian3.fromArray([0, 1, 2].map((axis) => box[axis] + box[side + axis]));
        const radius = Math.hypot(...box.slice(3));
        camera.lookAt(Cesium.Matrix4.multiplyByPoint(tileset.modelMatrix, target, target), new Cesium.HeadingPitchRange(
            Cesium.Math.toRadians(137 * view), Cesium.Math.toRadians(-8 - 8 * (view % 4)), distance * radius));
        camera.lookAtTransform(Cesium.Matrix4.IDENTITY);
        const drawn = what === 'source' ? source : tileset;
        [tileset, source].forEach((each) => { each.show = each === drawn; });
        tileset.debugColorizeTiles = what === 'nodes';
        tileset.customShader.setUniform('u_white', what === 'nodes' ? 1 : 0);
        await settled(drawn);
    },

    failures,
    background: BACKGROUND,
};

if (!checked) {
    const says = document.getElementById('says');
    opened.then(async ({ tileset, placed, place }) => {
        await window.hlod.look({ radii: 2.2 });
        const degrees = (angle) => Cesium.Math.toDegrees(angle).toFixed(6);
        const where = placed ? `${degrees(place.latitude)}° N ${degrees(place.longitude)}° E` : 'no place on the Earth';
        const write = () => {
            says.textContent = `${where}   ${failures.length ? failures[0] : ''}`;
            if (tileset.tilesLoaded) {
                says.textContent += '   loaded';
            }
        };
        scene.postRender.addEventListener(write);
        document.title = `hlod: ${folder}`;
    }).catch((error) => {
        says.textContent = String(error);
    });
} else {
    document.getElementById('says').remove();
    document.querySelectorAll('.cesium-viewer-bottom').forEach((element) => element.remove());
}
