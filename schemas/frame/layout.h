// The plain-data layout that every carrier uses for a stage call.
//
// A message is a list of columns. A column is a run of numbers of one type, aligned to 64 bytes, a fixed
// number of components per row; which columns a message has stands in schemas/gravitas/stage/v1/*.proto, in the order
// of the fields. In one process a column is a pointer; between processes it is an offset into a shared
// segment, preceded by a FrameHeader in the mailbox of the side that writes:
//
//   mailbox of the kernel (worker: read-only)      mailbox of the worker (both: read-write)
//   +--------------------------------+              +--------------------------------+
//   | signal, sleeping, cpu          |              | signal, sleeping, cpu          |
//   | FrameHeader                    |              | FrameHeader, progress, compute |
//   | FrameColumn[column_count]      |  request     | FrameColumn[column_count]      |  reply
//   | FrameColumn[reply_count], text |  room for    | text                           |
//   +--------------------------------+  the reply   +--------------------------------+
//        offsets into the state segment                offsets into the response segment
//
// All numbers are little-endian; doubles are IEEE 754. No type here has a constructor, a pointer that crosses
// a process, or padding without a name.
#pragma once

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { GRAVITAS_COLUMN_ALIGNMENT = 64, GRAVITAS_MAX_COLUMNS = 48 };

// "GRAVITAS" read as a big-endian number.
#define GRAVITAS_MAGIC UINT64_C(0x4752415649544153)

// Version of this file: counted up when a structure below changes.
enum { GRAVITAS_LAYOUT_VERSION = 2 };

// A body that is not one: the world in a joint, no shape of a body.
#define GRAVITAS_NONE UINT32_C(0xFFFFFFFF)

// A column to read. `count` is the number of elements, components counted singly.
typedef struct gravitas_column {
  const void* data;
  uint64_t count;
} gravitas_column;

// A column to fill. The writer sets `count`; a count beyond the capacity says how much room is needed, and
// nothing beyond the capacity is written.
typedef struct gravitas_reply_column {
  void* data;
  uint64_t capacity;
  uint64_t count;
} gravitas_reply_column;

// A column between processes. `offset` is in bytes from the start of the segment, a multiple of 64;
// `count` is in elements; `capacity` (room for a reply) too.
typedef struct gravitas_frame_column {
  uint64_t offset;
  uint64_t count;
  uint64_t capacity;
} gravitas_frame_column;

enum gravitas_frame_kind {
  GRAVITAS_FRAME_NONE = 0,
  GRAVITAS_FRAME_REQUEST = 1,   // kernel -> worker: a stage call
  GRAVITAS_FRAME_REPLY = 2,     // worker -> kernel: its answer
  GRAVITAS_FRAME_CALLBACK = 3,  // worker -> kernel: a derivative is asked for
  GRAVITAS_FRAME_ANSWER = 4,    // kernel -> worker: the derivative
  GRAVITAS_FRAME_CRASH = 5,     // worker -> kernel: a fatal signal was caught
  GRAVITAS_FRAME_STOP = 6       // kernel -> worker: leave the loop
};

typedef struct gravitas_frame_header {
  uint64_t magic;
  uint64_t schema_hash;
  uint64_t epoch;     // incarnation of the worker
  uint64_t sequence;  // of the call, counted up by the kernel
  uint32_t attempt;   // 0 for the first
  uint32_t kind;      // gravitas_frame_kind
  uint32_t method;    // stage::Method
  uint32_t target;    // which of the worker's plugins
  int32_t status;     // gravitas_status, in a reply
  uint32_t column_count;
  uint32_t reply_count;          // columns of the reply that room is described for
  uint32_t fault;                // 1 in a request whose sender's text orders a fault to be injected
  uint64_t state_generation;     // which state segment the offsets mean
  uint64_t response_generation;  // which response segment
  uint64_t deadline_ns;          // CLOCK_MONOTONIC
  uint64_t digest;               // of all that follows in the header's columns and, in a reply, of the data
} gravitas_frame_header;

// Answers of a plugin's functions.
enum gravitas_status {
  GRAVITAS_OK = 0,
  GRAVITAS_NEEDS_CAPACITY = 1,  // a reply column was too short; its count says what it takes
  GRAVITAS_REFUSED = 2,         // the request is impossible, the text says why
  GRAVITAS_FAILED = 3,          // the plugin itself failed (an exception)
  GRAVITAS_UNKNOWN_METHOD = 4,
  GRAVITAS_CALLBACK_FAILED = 5  // a derivative could not be had; the call is void
};

#ifdef __cplusplus
}
#endif
