// The C entry point of a plugin library: the whole of what crosses the border between a host and a plugin.
//
// A library exports one function, gravitas_plugin(), that returns a table of functions over plain data. No
// C++ type, exception or allocator crosses; the host may be the kernel (direct hosting) or gravitas-worker.
// Authors do not write this by hand: plugin.h makes it from a C++ class.
//
// Rules a table obeys: `create` and `call` may be called from any thread but never twice at once for one
// instance; a call's answer depends on its request and the settings alone; pointers of a request and a reply
// are valid during the call only; nothing may be kept but caches that can be rebuilt.
#pragma once

#include <stdint.h>

#include "schemas/frame/layout.h"

#ifdef __cplusplus
extern "C" {
#endif

// Counted up when a structure below changes.
enum { GRAVITAS_ABI_VERSION = 2 };

enum gravitas_slot {
  GRAVITAS_SLOT_SPACE = 1,
  GRAVITAS_SLOT_COLLISION = 2,
  GRAVITAS_SLOT_CONSTRAINT = 3,
  GRAVITAS_SLOT_FORCE = 4,
  GRAVITAS_SLOT_SOLVER = 5,
  GRAVITAS_SLOT_INTEGRATOR = 6
};

// See Property of plugin_sdk/property.h for the meaning of each field.
typedef struct gravitas_property {
  const char* name;
  const char* unit;
  const char* frame;
  const char* meaning;
  const double* default_numbers;
  const char* const* choices;
  double minimum;
  double maximum;
  uint32_t kind;
  uint32_t default_count;
  uint32_t choice_count;
  uint32_t columns;
  uint32_t exclusive_minimum;
  uint32_t required;
  uint32_t live;
  uint32_t reserved;
} gravitas_property;

typedef struct gravitas_coordinate {
  const char* name;
  const char* unit;
  const char* meaning;
} gravitas_coordinate;

typedef struct gravitas_type {
  const char* name;
  const char* meaning;
  const gravitas_property* properties;
  const gravitas_coordinate* coordinates;
  uint64_t property_count;
  uint64_t coordinate_count;
} gravitas_type;

typedef struct gravitas_description {
  const char* name;
  const char* version;
  const char* meaning;
  const char* const* capabilities;
  const gravitas_type* types;
  const gravitas_property* properties;
  uint64_t capability_count;
  uint64_t type_count;
  uint64_t property_count;
  double theta;
  uint32_t slot;
  uint32_t reserved;
} gravitas_description;

// What the host offers during a call.
typedef struct gravitas_host {
  void* context;
  // Answers Integrator.Derivative; GRAVITAS_OK or GRAVITAS_CALLBACK_FAILED. Null outside Integrate.
  int32_t (*derivative)(void* context, const gravitas_column* request, gravitas_reply_column* reply);
  // Says that the plugin is alive and getting on; prolongs the deadline, up to ten times it.
  void (*mark_progress)(void* context);
  // Runs body(argument, begin, end) over a fixed partition of 0 … count, on the threads of the host.
  void (*parallel_for)(void* context, uint64_t count, void (*body)(void* argument, uint64_t begin, uint64_t end),
                       void* argument);
} gravitas_host;

typedef struct gravitas_error {
  char text[512];
} gravitas_error;

typedef struct gravitas_plugin_table {
  uint64_t magic;  // GRAVITAS_MAGIC
  uint32_t abi_version;
  uint32_t layout_version;
  uint64_t schema_hash;
  const char* build_id;                     // says what the library was built by; nothing compares it
  const gravitas_description* description;  // null if it could not be made: the error of `create` says why
  // Settings are the plugin's own properties, flattened in the order of their declaration.
  int32_t (*create)(const double* settings, uint64_t count, void** instance, gravitas_error* error);
  void (*destroy)(void* instance);
  int32_t (*call)(void* instance, uint32_t method, const gravitas_column* request, gravitas_reply_column* reply,
                  const gravitas_host* host, gravitas_error* error);
} gravitas_plugin_table;

typedef const gravitas_plugin_table* (*gravitas_plugin_function)(void);

#ifdef __cplusplus
}
#endif
