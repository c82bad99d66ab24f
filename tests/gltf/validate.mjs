// validate.mjs FILE: Khronos' glTF validator; fails on any error or warning.
import { readFileSync } from "node:fs";
import validator from "gltf-validator";

const file = process.argv[2];
if (!file) {
  console.error("usage: node validate.mjs FILE");
  process.exit(1);
}
const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { uri: file });
const { numErrors, numWarnings, numInfos, messages } = report.issues;
for (const message of messages)
  console.log(`${["error", "warning", "info", "hint"][message.severity]}: ` +
    `${message.code} ${message.pointer ?? ""} ${message.message}`);
console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos`);
process.exit(numErrors + numWarnings > 0 ? 1 : 0);
