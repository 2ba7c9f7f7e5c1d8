// Files that a command reads and writes: none is written over that it reads, or writes under another option.
#pragma once

#include <string>
#include <vector>

#include "gravitas/edit/v1/edit.pb.h"
#include "services/run/session.h"

namespace gravitas {

struct NamedFile {
  std::string what;  // for errors: "--trajectory", "the scene"
  std::string path;  // none if empty
};

// What a scene was read from: its files, and the meshes that they name.
std::vector<NamedFile> files_of(const scene::v1::Scene& scene);

// Of --checkpoint and --resume, with their journals.
std::vector<NamedFile> checkpoints_of(const RunOptions& options);

// True if --checkpoint goes on in the file that --resume names, by whatever names.
bool goes_on_in_its_checkpoint(const RunOptions& options);

// Throws BadInput if an output is the same file as an input or as another output, by whatever names. Files that are not
// ordinary ones (devices, pipes) may be named twice.
void require_separate(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs);

// Of a run of a scene: files_of() it, those of edits, and what it is resumed from, which the checkpoint alone
// may replace.
void require_separate_files(const RunOptions& options, const scene::v1::Scene& scene,
                            const std::vector<edit::v1::Edit>& edits);

}  // namespace gravitas
