#include "services/run/file_names.h"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "services/recorder/durable_file.h"
#include "services/recorder/recorder.h"
#include "services/run/resumption.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;

// The file that a name leads to, by its one name.
fs::path target_of(const fs::path& path) {
  std::error_code none;
  return fs::weakly_canonical(fs::absolute(end_of_links(path)), none);
}

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code none;
  const fs::file_status one = fs::status(a, none), other = fs::status(b, none);
  if (fs::exists(one) != fs::exists(other)) return false;
  if (fs::exists(one)) return fs::is_regular_file(one) && fs::equivalent(a, b, none);
  // neither is there yet
  return target_of(a) == target_of(b);
}

void require_other(const NamedFile& output, const NamedFile& file) {
  if (output.path.empty() || file.path.empty() || !is_same_file(output.path, file.path)) return;
  throw BadInput(fmt::format("{} {}: it is the same file as {} {}; allowed: a file of its own", output.what,
                             output.path, file.what, file.path));
}

std::string journal(const std::string& path) { return path.empty() ? "" : journal_of(path); }

std::vector<NamedFile> outputs_of(const RunOptions& options) {
  return {{"--trajectory", options.trajectory},
          {"--report", options.report},
          {"--events", options.events},
          {"--reactions", options.reactions},
          {"--joints", options.joints},
          {"--instrumentation", options.instrumentation},
          {"--out", options.capsule}};
}

std::vector<NamedFile> kept_by(const RunOptions& options) {
  const std::string target = options.checkpoint.empty() ? "" : checkpoint_target(options.checkpoint);
  return {{"--checkpoint", target},
          {"the journal of --checkpoint", journal(target)},
          {"the next one of --checkpoint", target.empty() ? "" : fresh_name_of(target)}};
}

std::vector<NamedFile> resumed_by(const RunOptions& options) {
  const std::string target = options.resume.empty() ? "" : checkpoint_target(options.resume);
  return {{"--resume", options.resume}, {"the journal of --resume", journal(target)}};
}

}  // namespace

std::vector<NamedFile> checkpoints_of(const RunOptions& options) {
  std::vector<NamedFile> files = kept_by(options);
  for (NamedFile& file : resumed_by(options)) files.push_back(std::move(file));
  std::erase_if(files, [](const NamedFile& file) { return file.path.empty(); });
  return files;
}

bool goes_on_in_its_checkpoint(const RunOptions& options) {
  // hard links of one file have journals of their own: they are refused
  return !options.checkpoint.empty() && !options.resume.empty() &&
         target_of(options.checkpoint) == target_of(options.resume);
}

std::vector<NamedFile> files_of(const scene::v1::Scene& scene) {
  std::vector<NamedFile> files;
  // names of overrides among them are those of no file
  for (const std::string& name : scene.files()) files.push_back({"the scene", name});
  for (const scene::v1::Geometry& geometry : scene.geometries().geometry()) {
    const auto file = static_cast<int>(geometry.location().file());
    const fs::path folder = file < scene.files_size() ? fs::path(scene.files(file)).parent_path() : fs::path();
    for (const scene::v1::Property& property : geometry.custom_properties().property())
      if (property.name() == "File" && !property.value().text().empty())
        files.push_back({"a mesh of the scene,", (folder / property.value().text()).string()});
  }
  return files;
}

void require_separate(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    for (const NamedFile& input : inputs) require_other(outputs[i], input);
    for (std::size_t j = 0; j < i; ++j) require_other(outputs[i], outputs[j]);
  }
}

void require_separate_files(const RunOptions& options, const scene::v1::Scene& scene,
                            const std::vector<edit::v1::Edit>& edits) {
  std::vector<NamedFile> inputs = files_of(scene);
  const std::vector<NamedFile> kept = kept_by(options);
  const std::vector<NamedFile> resumed = resumed_by(options);
  for (const edit::v1::Edit& edit : edits)
    for (const edit::v1::Change& change : edit.changes())
      if (change.has_add()) inputs.push_back({"--edit add", change.add().name()});
  require_separate(inputs, kept);
  if (!goes_on_in_its_checkpoint(options)) require_separate(resumed, kept);
  for (const std::vector<NamedFile>* others : {&kept, &resumed})
    inputs.insert(inputs.end(), others->begin(), others->end());
  require_separate(inputs, outputs_of(options));
}

}  // namespace gravitas
