// SPDX-License-Identifier: BSD-3-Clause
import assert from "node:assert/strict";
import { test } from "node:test";
import { bytes_of_base64, Clouds, decode_cloud } from "../src/cloud";
import { base32, crc16, read_credential, sign } from "../src/credential";
import { compose, distance, inverse, transform, turn_deg } from "../src/pose";
import type { Pose } from "../src/schema";
import { SseParser } from "../src/sources/sse";
import type { SseEvent } from "../src/sources/sse";
import { Track } from "../src/track";
import { cloud_of } from "./fake_mission.mjs";

const buffer = (b: Buffer): ArrayBuffer => b.buffer.slice(b.byteOffset, b.byteOffset + b.byteLength) as ArrayBuffer;

test("a cloud comes out as it went in", () => {
  const cloud = decode_cloud(buffer(cloud_of(1, 3, 500) as Buffer));
  assert.equal(cloud.n, 500);
  assert.ok(Math.abs(cloud.step_m - 0.005) < 1e-9);
  assert.ok(cloud.radius_m > 3 && cloud.radius_m < 20);
  assert.equal(decode_cloud(bytes_of_base64((cloud_of(1, 3, 500) as Buffer).toString("base64"))).xyz[7], cloud.xyz[7]);
});

test("what is no cloud is refused", () => {
  const good = cloud_of(0, 0, 10) as Buffer;
  assert.throws(() => decode_cloud(buffer(good.subarray(0, 5))), /5 bytes/);
  assert.throws(() => decode_cloud(buffer(good.subarray(0, 60))), /10 points in 60 bytes/);
  const bad = Buffer.from(good);
  bad.writeFloatLE(NaN, 0);
  assert.throws(() => decode_cloud(buffer(bad)), /step of NaN/);
});

test("clouds above the bound become thinner, all of them alike", async () => {
  const clouds = new Clouds(
    (name) => Promise.resolve(buffer(cloud_of(0, Number(name), 600_000) as Buffer)),
    () => {},
  );
  for (let i = 0; i < 8; ++i) clouds.want(String(i));
  while (clouds.waiting > 0) await new Promise((resolve) => setTimeout(resolve, 5));
  assert.ok(clouds.points <= 4_000_000, `${clouds.points} points`);
  assert.ok(clouds.get("0")!.n > 300_000 && clouds.get("7")!.n > 300_000);
});

test("poses: inner frames cancel", () => {
  const A: Pose = [1, 2, 3, 0.1, 0.2, 0.3, Math.sqrt(1 - 0.14)];
  const B: Pose = [-4, 0.5, 2, 0, Math.SQRT1_2, 0, Math.SQRT1_2];
  const p = [0.3, -2, 5];
  assert.ok(distance(transform(compose(A, B), p), transform(A, transform(B, p))) < 1e-12);
  const none = compose(A, inverse(A));
  assert.ok(distance(none, [0, 0, 0]) < 1e-12 && turn_deg(none) < 1e-6);
  assert.ok(Math.abs(turn_deg(B) - 90) < 1e-9);
});

test("server-sent events arrive whole, however they are cut", () => {
  const text =
    ': alive\n\nevent: begin\ndata: {"incarnation": 3}\n\nid: 7\ndata: {"key":\r\ndata: "a"}\r\n\r\n: alive\n\nevent: ready\ndata: {}\n\n';
  for (const step of [1, 3, 7, 1000]) {
    const events: SseEvent[] = [];
    const parser = new SseParser((event) => events.push(event));
    for (let i = 0; i < text.length; i += step) parser.feed(text.slice(i, i + step));
    assert.deepEqual(
      events.map((e) => e.event),
      ["begin", "message", "ready"],
    );
    assert.equal(events[1].data, '{"key":\n"a"}');
    assert.equal(events[1].id, "7");
  }
});

test("a track finds what held at a time, and forgets the past evenly", () => {
  const track = new Track<number>();
  for (let t = 0; t < 10_000; ++t) track.push(t, t, 100);
  assert.ok(track.times.length <= 100);
  assert.equal(track.times[0], 0);
  assert.equal(track.values.length, track.times.length);
  assert.equal(track.at(9999.5), 9999);
  for (const t of [0, 500, 9000, 9990]) assert.equal(track.at(t), track.times[track.index(t)]);
  assert.equal(track.at(-1), null);
  const age = 9999 - track.times[50];
  assert.ok(age > 40 && age < 9900);
});

// A credential as `tutti pki` writes it, of the seed 0, 1, 2, .. 31.
const kSeedText = (() => {
  const bytes = Uint8Array.from([(18 << 3) | (20 >> 2), (20 << 6) & 255, ...Array.from({ length: 32 }, (_, i) => i)]);
  const crc = crc16(bytes);
  const all = [...bytes, crc & 255, crc >> 8];
  let bits = "";
  for (const byte of all) bits += byte.toString(2).padStart(8, "0");
  return bits
    .match(/.{1,5}/g)!
    .map((b) => "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567"[parseInt(b.padEnd(5, "0"), 2)])
    .join("");
})();
const credential = (role: string, seed = kSeedText) =>
  `tutti-credential 1\nmission: m\nrole: ${role}\nname: eva\nnumber: 3\nnkey: UABC\n-----BEGIN USER NKEY SEED-----\n${seed}\n-----END USER NKEY SEED-----\n`;

test("a credential is read, and its seed signs", async () => {
  globalThis.crypto ??= (await import("node:crypto")).webcrypto as Crypto; // Node 18
  assert.match(kSeedText, /^SU/);
  const read = read_credential(credential("operator"));
  assert.deepEqual([read.name, read.role, read.key], ["eva", "operator", "UABC"]);
  assert.deepEqual(
    [...read.seed],
    Array.from({ length: 32 }, (_, i) => i),
  );
  const signature = Buffer.from(await sign(read.seed, "nonce"), "base64");
  const { createPrivateKey, createPublicKey, verify } = await import("node:crypto");
  const key = createPrivateKey({
    key: Buffer.concat([Buffer.from("302e020100300506032b657004220420", "hex"), Buffer.from(read.seed)]),
    format: "der",
    type: "pkcs8",
  });
  assert.ok(verify(null, Buffer.from("nonce"), createPublicKey(key), signature));
});

test("what is no credential of a person is refused with a sentence", () => {
  assert.throws(() => read_credential("hello"), /no credential/);
  assert.throws(() => read_credential(credential("robot")), /credential of a robot/);
  assert.throws(
    () =>
      read_credential(
        credential("operator", kSeedText.slice(0, 20) + (kSeedText[20] === "A" ? "B" : "A") + kSeedText.slice(21)),
      ),
    /damaged/,
  );
  assert.equal(base32("MFRGG").length, 3);
});
