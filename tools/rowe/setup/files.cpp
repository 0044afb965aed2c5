// SPDX-License-Identifier: Apache-2.0
#include "files.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include "../console.hpp"
#include "../output.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t file_bytes_max = 1 << 20;

std::string because(std::string_view path, std::string_view what) {
  return joined(path, " ", what, ": ", std::generic_category().message(errno));
}

class descriptor {
 public:
  explicit descriptor(int number) noexcept : number_{number} {}
  descriptor(const descriptor&) = delete;
  descriptor& operator=(const descriptor&) = delete;
  ~descriptor() { (void)close(); }
  int get() const noexcept { return number_; }
  explicit operator bool() const noexcept { return number_ >= 0; }
  bool close() noexcept { return number_ < 0 || ::close(std::exchange(number_, -1)) == 0; }

 private:
  int number_;
};

// Makes the file, which must not be there, and leaves none if that fails. `like`: whose owner it gets.
bool make_file(int in, const char* name, ::mode_t mode, std::string_view content, const struct stat* like) {
  descriptor file{::openat(in, name, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode)};
  if (!file) return false;
  const bool owned =
      like == nullptr || like->st_uid == ::geteuid() || ::fchown(file.get(), like->st_uid, like->st_gid) == 0;
  if (owned && write_all(file.get(), content) == content.size() && ::fsync(file.get()) == 0 && file.close())
    return true;
  const int reason = errno;
  ::unlinkat(in, name, 0);
  errno = reason;
  return false;
}

struct listing_close {
  void operator()(DIR* one) const noexcept { ::closedir(one); }
};

// Names in the folder; empty, too, if it is not there or none.
std::vector<std::string> names_in(const std::string& path) {
  std::vector<std::string> names;
  const std::unique_ptr<DIR, listing_close> list{::opendir(path.c_str())};
  for (const dirent* one = list ? ::readdir(list.get()) : nullptr; one != nullptr;
       one = ::readdir(list.get())) {
    const std::string_view name = one->d_name;
    if (name != "." && name != "..") names.emplace_back(name);
  }
  return names;
}

// A folder beside the one that is to be. What is at its path in the end goes: itself if it was not put in
// place, the one that it replaced if it was; but of its files only those that we know.
class draft {
 public:
  draft(std::string pattern, const std::vector<std::string>& known)
      : path_{std::move(pattern)}, known_{known}, made_{::mkdtemp(path_.data()) != nullptr} {}
  draft(const draft&) = delete;
  draft& operator=(const draft&) = delete;
  ~draft() {
    const int reason = errno;
    if (const descriptor in = opened(); in) {
      for (const std::string& name : known_) ::unlinkat(in.get(), name.c_str(), 0);
      ::rmdir(path_.c_str());
    }
    errno = reason;
  }
  explicit operator bool() const noexcept { return made_; }
  const std::string& path() const noexcept { return path_; }

  bool write(const std::vector<new_file>& files, std::string& failed) const {
    const descriptor in = opened();
    failed = path_;
    if (!in) return false;
    for (const new_file& one : files) {
      failed = one.name;
      if (!make_file(in.get(), one.name.c_str(), one.mode, one.content, nullptr)) return false;
    }
    return ::fsync(in.get()) == 0;
  }

 private:
  // Nobody can have us write or remove elsewhere by a symbolic link in its place.
  descriptor opened() const {
    return descriptor{made_ ? ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC) : -1};
  }

  std::string path_;
  const std::vector<std::string>& known_;
  bool made_;
};

std::string parent_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == path.npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

// The folder's entry in its parent is to outlast a power cut, too.
void keep_entry(const std::string& path) noexcept {
  const descriptor parent{::open(parent_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (parent) (void)::fsync(parent.get()); // it is there, if not for sure after a power cut
}

} // namespace

std::size_t files_in(const std::string& path) { return names_in(path).size(); }

std::string make_folder(const std::string& asked, const std::vector<new_file>& files, bool replace,
                        const std::vector<std::string>& known, const last_step& before_it_is_there) {
  std::string path = asked;
  while (path.size() > 1 && path.ends_with('/')) path.pop_back();
  const std::vector<std::string> before = names_in(path);
  if (!before.empty() && !replace)
    return joined(path, " is there already, with ", counted(before.size(), "file"));
  for (const std::string& one : before) {
    if (std::find(known.begin(), known.end(), one) == known.end())
      return joined(path, " has a file that set-up does not make: ", printable(one));
  }
  const std::string name = path.substr(path.rfind('/') + 1); // npos + 1 is 0
  const draft made{joined(parent_of(path), "/.", name, ".XXXXXX"), known};
  if (!made) return because(path, "cannot be made");
  std::string failed;
  if (!made.write(files, failed)) return because(joined(path, "/", failed), "cannot be written");
  if (std::string wrong = before_it_is_there ? before_it_is_there() : std::string{}; !wrong.empty())
    return wrong;
  // With an exchange there is no moment without one of the two; the draft removes what it then has.
  const int done = before.empty()
                       ? ::rename(made.path().c_str(), path.c_str())
                       : ::renameat2(AT_FDCWD, made.path().c_str(), AT_FDCWD, path.c_str(), RENAME_EXCHANGE);
  if (done != 0) return because(path, "cannot be put in place");
  keep_entry(path);
  return {};
}

std::string write_new(const std::string& path, ::mode_t mode, std::string_view content) {
  if (make_file(AT_FDCWD, path.c_str(), mode, content, nullptr)) return {};
  if (errno == EEXIST)
    return joined(printable(path), " is there already: choose another name, or remove it first");
  return because(path, "cannot be made");
}

std::optional<folder> folder::open(const std::string& path, std::string& wrong) {
  const int number = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (number < 0) {
    wrong = because(path, "cannot be opened");
    return std::nullopt;
  }
  folder opened{number, path};
  if (::flock(number, LOCK_EX) == 0) return opened;
  wrong = because(path, "cannot be locked");
  return std::nullopt;
}

folder::folder(folder&& other) noexcept
    : descriptor_{std::exchange(other.descriptor_, -1)}, path_{std::move(other.path_)} {}

folder::~folder() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool folder::is_writable() const noexcept { return ::faccessat(descriptor_, ".", W_OK, AT_EACCESS) == 0; }

bool folder::has(const std::string& name) const noexcept {
  return ::faccessat(descriptor_, name.c_str(), F_OK, AT_SYMLINK_NOFOLLOW) == 0;
}

std::string folder::read(const std::string& name, std::string& into) const {
  const std::string path = joined(path_, "/", name);
  const descriptor file{::openat(descriptor_, name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC)};
  if (!file && errno == ELOOP) return joined(path, " is a symbolic link: name the folder that has the file");
  if (!file) return because(path, "cannot be opened");
  struct stat about {};
  if (::fstat(file.get(), &about) != 0 || !S_ISREG(about.st_mode)) return joined(path, " is not a file");
  into.clear();
  std::string piece(4096, '\0');
  while (true) {
    const ::ssize_t count = ::read(file.get(), piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return because(path, "cannot be read");
    if (count == 0) return {};
    into.append(piece, 0, static_cast<std::size_t>(count));
    if (into.size() > file_bytes_max) return joined(path, " is longer than ", file_bytes_max, " bytes");
  }
}

std::string folder::write(const new_file& file, const last_step& before_it_is_there) const {
  const std::string path = joined(path_, "/", file.name);
  struct stat before {};
  const bool there = ::fstatat(descriptor_, file.name.c_str(), &before, AT_SYMLINK_NOFOLLOW) == 0;
  if (there && !S_ISREG(before.st_mode)) return joined(path, " is not a file");
  const ::mode_t mode = there ? before.st_mode & file.mode : file.mode;
  // The lock is ours, so what stands there was left by one that was cut off.
  const std::string draft = joined(".", file.name, ".new");
  ::unlinkat(descriptor_, draft.c_str(), 0);
  if (!make_file(descriptor_, draft.c_str(), mode, file.content, there ? &before : nullptr))
    return because(path, "cannot be written");
  std::string wrong = before_it_is_there ? before_it_is_there() : std::string{};
  if (wrong.empty() && ::renameat(descriptor_, draft.c_str(), descriptor_, file.name.c_str()) != 0)
    wrong = because(path, "cannot be put in place");
  if (!wrong.empty()) {
    ::unlinkat(descriptor_, draft.c_str(), 0);
    return wrong;
  }
  if (::fsync(descriptor_) != 0) return because(path_, "cannot be written to the disk");
  return {};
}

} // namespace rowe::tools
