#!/bin/bash
# A part collapses to a line, without an error, once a tool has made its mesh small: assimp ignores that a glTF requires an extension,
# and reads its short numbers as floats.
#
# Guessed: a reader that does not know an extension which a file *requires* refuses the file, as the standard (glTF 2.0, 3.12) says.
# Seen with assimp 5.2.5 (Debian 12, libassimp5 5.2.5~ds0-1+b1) and GLTFLoader of three 0.187.0 on a box of 100 x 50 x 20 mm, as floats,
# and as gltf-transform 4.5.1 (npm, with meshoptimizer 1.3.0) writes it smaller. gltf-validator 2.0.0-dev.3.10 finds no error in any:
# - quantized (KHR_mesh_quantization: whole numbers of 16 bits, and scale and place at the node), assimp has twelve faces on one line, twice
#   as long as the box. It asks neither which type the numbers have nor what the file requires;
# - packed (EXT_meshopt_compression), it refuses the file, because the buffer has no bytes;
# - three has the box in all, to the digits of 16 bits.
# Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq libassimp-dev=5.2.5~ds0-1+b1 libassimp5=5.2.5~ds0-1+b1
for package in *.deb; do dpkg -x "$package" root; done
npm install --silent --no-fund --no-audit three@0.187.0 @gltf-transform/core@4.5.1 @gltf-transform/extensions@4.5.1 \
  @gltf-transform/functions@4.5.1 meshoptimizer@1.3.0 gltf-validator@2.0.0-dev.3.10
cat > make.mjs <<'JS'
import fs from "fs";
import { Document, NodeIO } from "@gltf-transform/core";
import { EXTMeshoptCompression, KHRMeshQuantization } from "@gltf-transform/extensions";
import { meshopt, quantize } from "@gltf-transform/functions";
import validator from "gltf-validator";
import { MeshoptDecoder, MeshoptEncoder } from "meshoptimizer";
await MeshoptEncoder.ready;
const points = [0, 0.02].flatMap((z) => [[0, 0, z], [0.1, 0, z], [0.1, 0.05, z], [0, 0.05, z]]);
const faces = [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7];
const make = () => {
  const document = new Document(), buffer = document.createBuffer();
  const accessor = (type, array) => document.createAccessor().setType(type).setArray(array).setBuffer(buffer);
  const part = document.createPrimitive().setAttribute("POSITION", accessor("VEC3", new Float32Array(points.flat())))
    .setIndices(accessor("SCALAR", new Uint16Array(faces)));
  document.createScene().addChild(document.createNode("part").setMesh(document.createMesh().addPrimitive(part)));
  return document;
};
const io = new NodeIO().registerExtensions([KHRMeshQuantization, EXTMeshoptCompression])
  .registerDependencies({ "meshopt.decoder": MeshoptDecoder, "meshopt.encoder": MeshoptEncoder });
const files = { floats: make(), quantized: make(), packed: make() };
await files.quantized.transform(quantize());
await files.packed.transform(meshopt({ encoder: MeshoptEncoder }));
for (const [name, document] of Object.entries(files)) {
  await io.write(`${name}.glb`, document);
  const { issues, info } = await validator.validateBytes(new Uint8Array(fs.readFileSync(`${name}.glb`)));
  console.log(`${name}: ${issues.numErrors} errors, requires ${(info.extensionsRequired ?? ["nothing"]).join(" ")}`);
}
JS
cat > read.cpp <<'CPP'
#include <algorithm>
#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cstdio>
#include <string>
int main(int count, char** names) {
  for (int k = 1; k < count; ++k) {
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(names[k] + std::string(".glb"), aiProcess_Triangulate | aiProcess_PreTransformVertices);
    if (!scene) {
      std::printf("assimp %s: refused\n", names[k]);
      continue;
    }
    aiVector3D low(1e9f), high(-1e9f);
    unsigned faces = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
      faces += scene->mMeshes[m]->mNumFaces;
      for (unsigned v = 0; v < scene->mMeshes[m]->mNumVertices; ++v)
        for (int i = 0; i < 3; ++i) {
          low[i] = std::min(low[i], scene->mMeshes[m]->mVertices[v][i]);
          high[i] = std::max(high[i], scene->mMeshes[m]->mVertices[v][i]);
        }
    }
    const aiVector3D size = (high - low) * 1000.f;
    std::printf("assimp %s: %u faces, %.1f x %.1f x %.1f mm\n", names[k], faces, size.x, size.y, size.z);
  }
}
CPP
include=root/usr/include libraries=root/usr/lib/x86_64-linux-gnu
g++ -std=c++17 -w read.cpp -I $include -L $libraries -Wl,-rpath,"$PWD/$libraries" -Wl,-rpath-link,$libraries -l:libassimp.so.5 -o read
cat > read.mjs <<'JS'
import fs from "fs";
import { MeshoptDecoder } from "meshoptimizer";
import { Box3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
globalThis.self = globalThis;
for (const name of process.argv.slice(2)) {
  const bytes = fs.readFileSync(`${name}.glb`);
  const { scene } = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder)
    .parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), "");
  scene.updateMatrixWorld(true);
  const { min, max } = new Box3().setFromObject(scene);
  console.log(`three ${name}: ${max.sub(min).toArray().map((x) => (x * 1000).toFixed(1)).join(" x ")} mm`);
}
JS
names="floats quantized packed"
node make.mjs | grep errors | tee seen
./read $names | tee -a seen
node read.mjs $names | tee -a seen
cat > expected <<'TEXT'
floats: 0 errors, requires nothing
quantized: 0 errors, requires KHR_mesh_quantization
packed: 0 errors, requires EXT_meshopt_compression KHR_mesh_quantization
assimp floats: 12 faces, 100.0 x 50.0 x 20.0 mm
assimp quantized: 12 faces, 201.4 x 0.0 x 0.0 mm
assimp packed: refused
three floats: 100.0 x 50.0 x 20.0 mm
three quantized: 100.0 x 50.0 x 20.0 mm
three packed: 100.0 x 50.0 x 20.0 mm
TEXT
diff expected seen && echo "as described"
