// Draws the vertices of nodes. Colours are in linear light: the target encodes them.

struct Camera {
    clip_from_scene: mat4x4<f32>,
    metres_per_pixel: vec2<f32>,
    corner: vec2<f32>,
    // Two corners of a box, metres from the eye.
    box_min: vec3<f32>,
    box_max: vec3<f32>,
    // Right, down, ahead.
    to_light: vec3<f32>,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(0) var picture: texture_2d<f32>;
@group(1) @binding(1) var picture_sampler: sampler;

// Surfaces are lit.
override LIT: bool = false;
// Fragments with less than half of the scaled alpha are left away.
override MASK: bool = false;
// Fragments are left away by a pattern, as many as alpha says.
override SCREEN: bool = false;
// Fragments outside of the box are left away.
override INSIDE: bool = false;
// Fragments inside of the box are left away.
override OUTSIDE: bool = false;

struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) texcoord: vec2<f32>,
    @location(2) color: vec4<f32>,
    @location(3) offset: vec3<f32>,
    @location(4) alpha_scale: f32,
    @location(5) tint: vec3<f32>,
    @location(6) projection: vec4<f32>,
}

struct Textured {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec4<f32>,
    @location(1) texcoord: vec2<f32>,
}

struct Plain {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec4<f32>,
}

// The same with where they are, metres from the eye.
struct BoxedTextured {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec4<f32>,
    @location(1) texcoord: vec2<f32>,
    @location(2) at: vec3<f32>,
}

struct BoxedPlain {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec4<f32>,
    @location(2) at: vec3<f32>,
}

// Texture coordinates times the depth in the picture's own camera, and that depth: what is linear along
// a triangle.
struct Projected {
    @builtin(position) position: vec4<f32>,
    @location(0) texcoord: vec3<f32>,
}

// IEC 61966-2-1.
fn linear_of(encoded: vec3<f32>) -> vec3<f32> {
    let high = pow((encoded + 0.055) / 1.055, vec3(2.4));
    return select(high, encoded / 12.92, encoded <= vec3(0.04045));
}

fn place(vertex: Vertex) -> vec4<f32> {
    return camera.clip_from_scene * vec4(vertex.position + vertex.offset, 1.0);
}

fn color_of(vertex: Vertex) -> vec4<f32> {
    return vec4(linear_of(vertex.color.rgb) * vertex.tint, vertex.color.a * vertex.alpha_scale);
}

@vertex
fn place_textured(vertex: Vertex) -> Textured {
    return Textured(place(vertex), color_of(vertex), vertex.texcoord);
}

@vertex
fn place_plain(vertex: Vertex) -> Plain {
    return Plain(place(vertex), color_of(vertex));
}

@vertex
fn place_boxed_textured(vertex: Vertex) -> BoxedTextured {
    let at = vertex.position + vertex.offset;
    return BoxedTextured(place(vertex), color_of(vertex), vertex.texcoord, at);
}

@vertex
fn place_boxed_plain(vertex: Vertex) -> BoxedPlain {
    return BoxedPlain(place(vertex), color_of(vertex), vertex.position + vertex.offset);
}

@vertex
fn place_projected(vertex: Vertex) -> Projected {
    let depth = dot(vec4(vertex.position, 1.0), vertex.projection);
    // What is drawn itself comes before a picture of it: depth is near over distance.
    var at = place(vertex);
    at.z *= 0.98;
    return Projected(at, vec3(vertex.texcoord * depth, depth));
}

fn is_left_away(at: vec3<f32>) -> bool {
    let inside = all(at >= camera.box_min) && all(at <= camera.box_max);
    return (INSIDE && !inside) || (OUTSIDE && inside);
}

// How bright the plane of the triangle is, from either side.
//
// On a plane a·x + b·y + c·z = d the reciprocal of the distance is linear in the picture:
// 1/z = a·(x/z) + b·(y/z) + c, each divided by d. So its slopes across the picture are the
// plane's normal, and no normals need to be stored or interpolated.
fn light_of(position: vec4<f32>) -> f32 {
    let slope = vec2(dpdx(position.w), dpdy(position.w)) / camera.metres_per_pixel;
    let at = camera.corner + position.xy * camera.metres_per_pixel;
    let normal = normalize(vec3(slope, position.w - dot(slope, at)));
    return 0.3 + 0.7 * abs(dot(normal, camera.to_light));
}

// The threshold of a pixel: the sixteenths of a 4 × 4 Bayer matrix.
fn screen(position: vec4<f32>) -> f32 {
    let p = vec2<u32>(position.xy);
    let a = p.x ^ p.y;
    let rank = ((a & 1u) << 3u) | ((p.y & 1u) << 2u) | (a & 2u) | ((p.y & 2u) >> 1u);
    return (f32(rank) + 0.5) / 16.0;
}

fn shade(color: vec4<f32>, position: vec4<f32>) -> vec4<f32> {
    var light = 1.0;
    if LIT {
        light = light_of(position);
    }
    if MASK && color.a < 0.5 {
        discard;
    }
    if SCREEN && color.a < screen(position) {
        discard;
    }
    return vec4(color.rgb * light, 1.0);
}

@fragment
fn shade_textured(fragment: Textured) -> @location(0) vec4<f32> {
    let texel = textureSample(picture, picture_sampler, fragment.texcoord);
    return shade(texel * fragment.color, fragment.position);
}

@fragment
fn shade_plain(fragment: Plain) -> @location(0) vec4<f32> {
    return shade(fragment.color, fragment.position);
}

@fragment
fn shade_boxed_textured(fragment: BoxedTextured) -> @location(0) vec4<f32> {
    let texel = textureSample(picture, picture_sampler, fragment.texcoord);
    let color = shade(texel * fragment.color, fragment.position);
    if is_left_away(fragment.at) {
        discard;
    }
    return color;
}

@fragment
fn shade_boxed_plain(fragment: BoxedPlain) -> @location(0) vec4<f32> {
    let color = shade(fragment.color, fragment.position);
    if is_left_away(fragment.at) {
        discard;
    }
    return color;
}

// A picture holds the light in which it was taken.
@fragment
fn shade_projected(fragment: Projected) -> @location(0) vec4<f32> {
    let texel = textureSample(picture, picture_sampler, fragment.texcoord.xy / fragment.texcoord.z);
    return vec4(texel.rgb, 1.0);
}
