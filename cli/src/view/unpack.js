// The engine and the scripts in the page: compressed (LZMA, whose decoder is smaller than what it saves over the browser's own),
// and written seven bits to a byte.

// Bytes of a text whose letters carry seven bits each: those up to 127 themselves; three that HTML would change (0, CR and <) and
// the seven bits after each of them are one letter from 256 on.
function letters(text) {
  const CHANGED = [0, 13, 60], out = new Uint8Array(2 * text.length);
  let [n, bits, count] = [0, 0, 0];
  const push = (seven) => {
    bits = ((bits << 7) | seven) & 0x7fff;
    count += 7;
    if (count >= 8) out[n++] = (bits >> (count -= 8)) & 255;
  };
  for (let k = 0; k < text.length; k++) {
    const code = text.charCodeAt(k);
    if (code < 128) push(code);
    else {
      push(CHANGED[(code - 256) >> 7]);
      push(code & 127);
    }
  }
  return out.subarray(0, n);
}

// Decompresses LZMA with its header of 13 bytes and an end mark (I. Pavlov's specification), without bits of the position
// (`lp` and `pb` are 0).
function unlzma(input) {
  const lc = input[0];
  let out = new Uint8Array(1 << 22), n = 0, at = 18, range = -1 >>> 0;
  let code = ((input[14] << 24) | (input[15] << 16) | (input[16] << 8) | input[17]) >>> 0;
  const odds = (count) => new Uint16Array(count).fill(1024);
  const bit = (table, k) => {
    const p = table[k], bound = (range >>> 11) * p;
    let b = 0;
    if (code < bound) {
      range = bound;
      table[k] = p + ((2048 - p) >> 5);
    } else {
      range -= bound;
      code -= bound;
      table[k] = p - (p >> 5);
      b = 1;
    }
    if (range < 16777216) {
      range = (range << 8) >>> 0;
      code = ((code << 8) | input[at++]) >>> 0;
    }
    return b;
  };
  const direct = (count) => {
    let value = 0;
    while (count-- > 0) {
      range >>>= 1;
      const b = code >= range ? 1 : 0;
      if (b) code -= range;
      if (range < 16777216) {
        range = (range << 8) >>> 0;
        code = ((code << 8) | input[at++]) >>> 0;
      }
      value = value * 2 + b;
    }
    return value;
  };
  const tree = (table, base, count) => {
    let k = 1;
    for (let i = 0; i < count; i++) k = 2 * k + bit(table, base + k);
    return k - (1 << count);
  };
  const reversed = (table, base, count) => {
    let [k, value] = [1, 0];
    for (let i = 0; i < count; i++) {
      const b = bit(table, base + k);
      k = 2 * k + b;
      value |= b << i;
    }
    return value;
  };
  const literal = odds(0x300 << lc), isMatch = odds(12), isRep = odds(12), repG0 = odds(12), repG1 = odds(12), repG2 = odds(12), rep0Long = odds(12);
  const slot = odds(256), special = odds(128), align = odds(16);
  const lengths = () => ({ choice: odds(2), low: odds(8), mid: odds(8), high: odds(256) });
  const matchLength = lengths(), repLength = lengths();
  const length = ({ choice, low, mid, high }) => {
    if (!bit(choice, 0)) return 2 + tree(low, 0, 3);
    return bit(choice, 1) ? 18 + tree(high, 0, 8) : 10 + tree(mid, 0, 3);
  };
  let state = 0, [rep0, rep1, rep2, rep3] = [0, 0, 0, 0];
  for (;;) {
    if (n + 300 > out.length) {
      const larger = new Uint8Array(2 * out.length);
      larger.set(out);
      out = larger;
    }
    if (!bit(isMatch, state)) {
      const before = n ? out[n - 1] : 0, base = 0x300 * (before >> (8 - lc));
      let symbol = 1;
      if (state >= 7) {
        let match = out[n - rep0 - 1];
        while (symbol < 256) {
          const b = (match >> 7) & 1, got = bit(literal, base + ((1 + b) << 8) + symbol);
          match <<= 1;
          symbol = 2 * symbol + got;
          if (b !== got) break;
        }
      }
      while (symbol < 256) symbol = 2 * symbol + bit(literal, base + symbol);
      out[n++] = symbol & 255;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let count;
    if (bit(isRep, state)) {
      if (!bit(repG0, state)) {
        if (!bit(rep0Long, state)) {
          state = state < 7 ? 9 : 11;
          out[n] = out[n - rep0 - 1];
          n++;
          continue;
        }
      } else if (!bit(repG1, state)) [rep0, rep1] = [rep1, rep0];
      else if (!bit(repG2, state)) [rep0, rep1, rep2] = [rep2, rep0, rep1];
      else [rep0, rep1, rep2, rep3] = [rep3, rep0, rep1, rep2];
      count = length(repLength);
      state = state < 7 ? 8 : 11;
    } else {
      [rep1, rep2, rep3] = [rep0, rep1, rep2];
      count = length(matchLength);
      state = state < 7 ? 7 : 10;
      const first = tree(slot, Math.min(count - 2, 3) << 6, 6);
      rep0 = first;
      if (first > 3) {
        const footer = (first >> 1) - 1, base = ((2 | (first & 1)) << footer) >>> 0;
        if (first < 14) rep0 = base + reversed(special, base - first, footer);
        else rep0 = base + direct(footer - 4) * 16 + reversed(align, 0, 4);
      }
      if (rep0 === 4294967295) return out.subarray(0, n);
    }
    for (let k = 0; k < count; k++, n++) out[n] = out[n - rep0 - 1];
  }
}
