// SPDX-License-Identifier: BSD-3-Clause
// Everything goes into one file: web/dist/index.html, which the C++ programs embed.
import { defineConfig } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

export default defineConfig({
  base: "./",
  plugins: [viteSingleFile()],
  build: { target: "es2022", modulePreload: false, reportCompressedSize: false },
});
