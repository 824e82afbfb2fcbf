// Sends each code on standard input to all channels; 0.8 s later prints the seven positions, wire order.
import { openSync, readSync, writeSync } from "node:fs";
import { createInterface } from "node:readline";
import { setTimeout } from "node:timers/promises";

const hand = openSync(process.argv[2], "r+");
const frame = (opcode, word) => Buffer.concat([Buffer.from([opcode, 0]), Buffer.from(Uint16Array.of(...Array(7).fill(word)).buffer)]);
for await (const line of createInterface({ input: process.stdin })) {
  writeSync(hand, frame(0x11, Number(line)));
  await setTimeout(800);
  writeSync(hand, frame(0x22, 0));
  const reply = Buffer.alloc(16);
  for (let got = 0; got < 16; ) got += readSync(hand, reply, got, 16 - got, null);
  console.log([...Array(7).keys()].map((i) => reply.readUInt16LE(2 + 2 * i)).join(" "));
}
