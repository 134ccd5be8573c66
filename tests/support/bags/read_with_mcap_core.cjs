// SPDX-License-Identifier: BSD-3-Clause
// Reads an MCAP file with other people's libraries, by its index and as a stream, every CRC checked, every message
// decoded by the definition that stands in the file. Prints a line per message: topic, stamp in ns, JSON.
// usage: node read_with_mcap_core.cjs FILE; exits with 77 where the libraries are not there.
"use strict";
const fs = require("fs");
let mcap, fzstd, rosmsg, serialization;
try {
  const load = (name) => require(require.resolve(name, { paths: [process.env.TUTTI_NODE_MODULES || "."] }));
  mcap = load("@mcap/core");
  fzstd = load("fzstd");
  rosmsg = load("@foxglove/rosmsg");
  serialization = load("@foxglove/rosmsg2-serialization");
} catch (error) {
  process.exit(77);
}
const decompressHandlers = { zstd: (packed) => fzstd.decompress(packed) };
const plain = (key, value) =>
  typeof value === "bigint" ? value.toString() : ArrayBuffer.isView(value) ? Array.from(value) : value;

async function main() {
  const bytes = fs.readFileSync(process.argv[2]);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
  };
  const indexed = await mcap.McapIndexedReader.Initialize({ readable, decompressHandlers });
  const decoders = new Map();
  for (const [id, channel] of indexed.channelsById) {
    const schema = indexed.schemasById.get(channel.schemaId);
    const text = new TextDecoder().decode(schema.data);
    if (channel.messageEncoding === "json") {
      decoders.set(id, (data) => JSON.parse(new TextDecoder().decode(data)));
    } else {
      const reader = new serialization.MessageReader(rosmsg.parse(text, { ros2: true }));
      decoders.set(id, (data) => reader.readMessage(data));
    }
  }
  let found = 0n;
  for await (const message of indexed.readMessages()) {
    const topic = indexed.channelsById.get(message.channelId).topic;
    console.log(topic, message.logTime.toString(), JSON.stringify(decoders.get(message.channelId)(message.data), plain));
    found += 1n;
  }
  const stream = new mcap.McapStreamReader({ decompressHandlers, validateCrcs: true });
  stream.append(bytes);
  let streamed = 0n;
  for (let record; (record = stream.nextRecord()); ) streamed += record.type === "Message" ? 1n : 0n;
  if (!stream.done()) throw new Error("the stream does not end");
  if (indexed.statistics.messageCount !== found || streamed !== found)
    throw new Error(`${indexed.statistics.messageCount} messages by the statistics, ${found} indexed, ${streamed} streamed`);
}
main().catch((error) => {
  console.error(error.message);
  process.exit(1);
});
