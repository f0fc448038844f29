// The server's half of RFC 6455 that a page needs: text frames out, close and ping answered. For
// the mock alone.
import { createHash } from 'node:crypto';

const MAGIC = '258EAFA5-E914-47DA-95CA-C5AB0DC85B11'; // RFC 6455, section 1.3

function frame(opcode, payload) {
  const length = payload.length;
  const head = length < 126 ? Buffer.from([0x80 | opcode, length])
    : length < 65536 ? Buffer.from([0x80 | opcode, 126, length >> 8, length & 255])
    : Buffer.concat([Buffer.from([0x80 | opcode, 127]), (() => { const b = Buffer.alloc(8); b.writeBigUInt64BE(BigInt(length)); return b; })()]);
  return Buffer.concat([head, payload]);
}

/**
 * Takes over an upgrade request; returns {send(text), close()}, and calls `gone` when the other
 * side has left.
 */
export function acceptWebSocket(request, socket, gone) {
  const accept = createHash('sha1').update(request.headers['sec-websocket-key'] + MAGIC).digest('base64');
  socket.write(`HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: ${accept}\r\n\r\n`);
  socket.on('data', (bytes) => {
    const opcode = bytes[0] & 15;
    if (opcode === 8) socket.end(frame(8, Buffer.alloc(0)));
  });
  socket.on('error', () => socket.destroy());
  socket.on('close', gone);
  return { send: (text) => socket.writable && socket.write(frame(1, Buffer.from(text))), close: () => socket.destroy() };
}
