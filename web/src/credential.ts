// SPDX-License-Identifier: BSD-3-Clause
/** The credential of `tutti pki`: read in the page, signed with in the page, never sent. */

export interface Credential {
  name: string;
  role: string;
  /** Public nkey, "U...". */
  key: string;
  seed: Uint8Array;
}

const kFirstLine = "tutti-credential 1";
const kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567";
/** Two bytes of prefix, 32 of seed, two of CRC-16. */
const kSeedBytes = 36;

/** Throws an Error with a sentence. */
export function read_credential(text: string): Credential {
  if (!text.startsWith(kFirstLine))
    throw new Error("This is no credential: expected a file that `tutti pki` has made.");
  const field = (key: string) => new RegExp(`^${key}: (.*)$`, "m").exec(text)?.[1]?.trim() ?? "";
  const seed = /-----BEGIN USER NKEY SEED-----\r?\n(SU[A-Z2-7]+)\r?\n/.exec(text)?.[1] ?? "";
  const out = { name: field("name"), role: field("role"), key: field("nkey"), seed: seed_of(seed) };
  if (!out.name || !out.key.startsWith("U")) throw new Error("This credential lacks its name or its key.");
  if (out.role !== "operator" && out.role !== "viewer")
    throw new Error(`This is the credential of a ${out.role}; the page takes an operator's or a viewer's.`);
  return out;
}

function seed_of(text: string): Uint8Array {
  const bytes = base32(text);
  if (bytes.length !== kSeedBytes) throw new Error("This credential lacks its seed.");
  const crc = crc16(bytes.subarray(0, kSeedBytes - 2));
  if (crc !== bytes[kSeedBytes - 2] + 256 * bytes[kSeedBytes - 1])
    throw new Error("The seed of this credential is damaged.");
  return bytes.slice(2, kSeedBytes - 2);
}

export function base32(text: string): Uint8Array {
  const out: number[] = [];
  let bits = 0;
  let held = 0;
  for (const letter of text) {
    held = (held << 5) | kAlphabet.indexOf(letter);
    bits += 5;
    if (bits >= 8) {
      bits -= 8;
      out.push((held >> bits) & 255);
      held &= (1 << bits) - 1;
    }
  }
  return Uint8Array.from(out);
}

/** CRC-16/XMODEM, as nkeys have it. */
export function crc16(bytes: Uint8Array): number {
  let crc = 0;
  for (const byte of bytes) {
    crc ^= byte << 8;
    for (let i = 0; i < 8; ++i) crc = crc & 0x8000 ? ((crc << 1) ^ 0x1021) & 0xffff : (crc << 1) & 0xffff;
  }
  return crc;
}

/** An Ed25519 private key as PKCS #8 begins with these bytes; the seed follows. */
const kPkcs8 = [0x30, 0x2e, 0x02, 0x01, 0x00, 0x30, 0x05, 0x06, 0x03, 0x2b, 0x65, 0x70, 0x04, 0x22, 0x04, 0x20];

/** Base64 of the Ed25519 signature over the text's bytes. */
export async function sign(seed: Uint8Array, text: string): Promise<string> {
  if (!globalThis.crypto?.subtle)
    throw new Error("This browser signs only over HTTPS or on localhost: open the page there.");
  const key = await crypto.subtle.importKey(
    "pkcs8",
    Uint8Array.from([...kPkcs8, ...seed]),
    { name: "Ed25519" },
    false,
    ["sign"],
  );
  const signature = await crypto.subtle.sign("Ed25519", key, new TextEncoder().encode(text));
  return btoa(String.fromCharCode(...new Uint8Array(signature)));
}
