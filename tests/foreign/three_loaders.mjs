// Prints what a loader of three.js reads from a file: node three_loaders.mjs FOLDER_OF_LOADERS FILE
import fs from "fs";
import path from "path";
import { pathToFileURL } from "url";

console.time = console.timeEnd = () => {}; // which the loaders print
const [folder, file] = process.argv.slice(2);
const name = { ".ply": "PLYLoader", ".obj": "OBJLoader" }[path.extname(file)];
const loader = new (await import(pathToFileURL(path.join(folder, name + ".js"))))[name]();
const bytes = fs.readFileSync(file);
let geometries;
if (name === "PLYLoader")
  geometries = [loader.parse(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length))];
else
  geometries = loader.parse(bytes.toString()).children.map((child) => child.geometry);
console.log(JSON.stringify(geometries.map(({ attributes }) =>
  Object.fromEntries(Object.entries(attributes).map(([key, { array }]) => [key, Array.from(array)])))));
