// Numbers in messages: the suffix of the methods of DataView, and the size in bytes.
// Written by `python -m tests.support.page_primitives` from the definitions of the library.

export const PRIMITIVES = {
  int8: ["Int8", 1],
  uint8: ["Uint8", 1],
  byte: ["Int8", 1],
  char: ["Uint8", 1],
  int16: ["Int16", 2],
  uint16: ["Uint16", 2],
  int32: ["Int32", 4],
  uint32: ["Uint32", 4],
  int64: ["BigInt64", 8],
  uint64: ["BigUint64", 8],
  float32: ["Float32", 4],
  float64: ["Float64", 8],
  bool: ["Uint8", 1],
};
