/// OpenEXR through streams in memory: files are read whole and written atomically by core/files. The library throws;
/// nothing it throws leaves this file.

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <optional>
#include <stdexcept>

#include "formats.hpp"

namespace pathscope {
namespace {

class MemoryOutput : public Imf::OStream {
  public:
    MemoryOutput() : Imf::OStream("memory") {}

    void write(const char data[], int size) override {
        const std::size_t end = position_ + std::size_t(size);
        if (end > bytes_.size()) bytes_.resize(end);
        std::memcpy(&bytes_[position_], data, std::size_t(size));
        position_ = end;
    }
    std::uint64_t tellp() override { return position_; }
    void seekp(std::uint64_t position) override {
        position_ = position;
    }  // Back, to fill in the table of rows.

    std::string take() { return std::move(bytes_); }

  private:
    std::string bytes_;
    std::size_t position_ = 0;
};

class MemoryInput : public Imf::IStream {
  public:
    explicit MemoryInput(std::string_view bytes) : Imf::IStream("memory"), bytes_(bytes) {}

    bool read(char data[], int size) override {
        if (size < 0 || position_ > bytes_.size() || std::size_t(size) > bytes_.size() - position_)
            throw std::runtime_error("it ends too early");
        std::memcpy(data, bytes_.data() + position_, std::size_t(size));
        position_ += std::size_t(size);
        return position_ < bytes_.size();
    }
    std::uint64_t tellg() override { return position_; }
    void seekg(std::uint64_t position) override { position_ = position; }

  private:
    std::string_view bytes_;
    std::uint64_t position_ = 0;
};

/// Where the floats of one channel lie: OpenEXR asks for the address that pixel (0, 0) would have.
Imf::Slice slice_of(const float* first, int pixel_floats, const Imath::Box2i& window) {
    const std::size_t x_stride = std::size_t(pixel_floats) * sizeof(float);
    const std::size_t y_stride = x_stride * (std::size_t(window.max.x - window.min.x) + 1);
    return Imf::Slice::Make(Imf::FLOAT, first, window, x_stride, y_stride);
}

constexpr const char* k_rgb_names[3] = {"R", "G", "B"};

void add_channel(const std::string& name, const float* first, int pixel_floats, Imf::Header& header,
                 Imf::FrameBuffer& frame) {
    CHECK(header.channels().findChannel(name) == nullptr, name);
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    frame.insert(name, slice_of(first, pixel_floats, header.dataWindow()));
}

void add_channels(const std::string& prefix, const Image& image, Imf::Header& header,
                  Imf::FrameBuffer& frame) {
    static_assert(sizeof(Rgb) == 3 * sizeof(float));
    for (int c = 0; c < 3; ++c)
        add_channel(prefix + k_rgb_names[c], &image.pixels[0].x + c, 3, header, frame);
}

std::string write_exr(std::span<const ImageLayer> layers, const Metadata& metadata) {
    const Image& first = *std::get<const Image*>(layers[0].picture);
    Imf::Header header(first.width, first.height);
    header.compression() = Imf::ZIP_COMPRESSION;
    for (const auto& [key, value] : metadata) header.insert(key, Imf::StringAttribute(value));

    Imf::FrameBuffer frame;
    add_channels("", first, header, frame);
    for (const ImageLayer& layer : layers.subspan(1)) {
        if (const auto* image = std::get_if<const Image*>(&layer.picture))
            add_channels(layer.name + ".", **image, header, frame);
        else
            add_channel(layer.name, std::get<const Plane*>(layer.picture)->pixels.data(), 1, header, frame);
    }

    MemoryOutput stream;
    {
        Imf::OutputFile file(stream, header);
        file.setFrameBuffer(frame);
        file.writePixels(first.height);
    }  // The destructor writes the table of rows.
    return stream.take();
}

/// A file whose head has been read and found sane.
struct OpenExr {
    MemoryInput stream;
    Imf::InputFile file;
    Imath::Box2i window;
    int width = 0, height = 0;

    explicit OpenExr(std::string_view bytes)
        : stream(bytes), file(stream), window(file.header().dataWindow()) {
        width = window.max.x - window.min.x + 1;
        height = window.max.y - window.min.y + 1;
    }

    [[nodiscard]] bool has(const std::string& channel) const {
        return file.header().channels().findChannel(channel) != nullptr;
    }

    /// Channels are converted to float; what the file lacks stays 0.
    void read(Imf::FrameBuffer& frame) {
        file.setFrameBuffer(frame);
        file.readPixels(window.min.y, window.max.y);
    }
};

/// Limits of the library itself, which hold before it has told us any size.
void limit_sizes() {
    static const bool done = [] {
        Imf::Header::setMaxImageSize(k_max_image_side, k_max_image_side);
        Imf::Header::setMaxTileSize(k_max_image_side, k_max_image_side);
        return true;
    }();
    static_cast<void>(done);
}

Result<void> check_head(const OpenExr& exr, std::string_view name) {
    if (const auto size = check_picture_size(exr.width, exr.height, name); !size) return size.error();
    const Imf::ChannelList& channels = exr.file.header().channels();
    std::int64_t count = 0;
    for (auto channel = channels.begin(); channel != channels.end(); ++channel, ++count)
        if (channel.channel().xSampling != 1 || channel.channel().ySampling != 1)
            return bad_input(
                fmt::format("{}: channel {} has fewer pixels than the picture; save it without chroma "
                            "subsampling.",
                            name, channel.name()));
    if (count * exr.width * exr.height > 8 * k_max_pixels)
        return bad_input(
            fmt::format("{}: {} channels of {}x{} pixels are too many.", name, count, exr.width, exr.height));
    return {};
}

Image read_rgb(OpenExr& exr) {
    Image image(exr.width, exr.height);
    Imf::FrameBuffer frame;
    for (int c = 0; c < 3; ++c) frame.insert(k_rgb_names[c], slice_of(&image.pixels[0].x + c, 3, exr.window));
    exr.read(frame);
    return image;
}

Image read_grey(OpenExr& exr) {
    Image image(exr.width, exr.height);
    Imf::FrameBuffer frame;
    frame.insert("Y", slice_of(&image.pixels[0].x, 3, exr.window));
    exr.read(frame);
    for (Rgb& pixel : image.pixels) pixel = {pixel.x, pixel.x, pixel.x};
    return image;
}

/// "direct." of "direct.R" when G and B stand beside it; nothing when the channel is one for itself.
std::optional<std::string> rgb_prefix(const OpenExr& exr, const std::string& channel) {
    if (channel.empty() || std::string_view("RGB").find(channel.back()) == std::string_view::npos) return {};
    const std::string prefix = channel.substr(0, channel.size() - 1);
    const bool whole = exr.has(prefix + "R") && exr.has(prefix + "G") && exr.has(prefix + "B");
    if (!whole || !(prefix.empty() || prefix.ends_with('.'))) return {};
    return prefix;
}

LayeredImage read_layers(OpenExr& exr) {
    LayeredImage all;
    Imf::FrameBuffer frame;
    const Imf::Header& header = exr.file.header();
    for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
        const std::string name = channel.name();
        if (const auto prefix = rgb_prefix(exr, name)) {
            const std::string layer = prefix->substr(0, prefix->find_last_of('.'));
            Image& image = all.images.try_emplace(layer, exr.width, exr.height).first->second;
            const std::size_t c = std::string_view("RGB").find(name.back());
            frame.insert(name, slice_of(&image.pixels[0].x + c, 3, exr.window));
        } else {
            Plane& plane = all.planes.try_emplace(name, exr.width, exr.height).first->second;
            frame.insert(name, slice_of(plane.pixels.data(), 1, exr.window));
        }
    }
    exr.read(frame);

    for (auto attribute = header.begin(); attribute != header.end(); ++attribute)
        if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute.attribute()))
            all.metadata.emplace(attribute.name(), text->value());
    return all;
}

/// Opens the file, checks its head, and hands it to `read`; whatever is thrown becomes a sentence.
template <class Picture, class Read>
Result<Picture> with_exr(std::string_view bytes, std::string_view name, Read&& read) {
    try {
        limit_sizes();
        OpenExr exr(bytes);
        if (const auto head = check_head(exr, name); !head) return head.error();
        return read(exr);
    } catch (const std::exception& error) {
        return bad_input(fmt::format("{}: the .exr cannot be read ({}).", name, error.what()));
    }
}

}  // namespace

bool is_exr(std::string_view bytes) { return bytes.starts_with("\x76\x2f\x31\x01"); }

Result<std::string> encode_exr(std::span<const ImageLayer> layers, const Metadata& metadata,
                               std::string_view name) {
    try {
        return write_exr(layers, metadata);
    } catch (const std::exception& error) {
        return failed(fmt::format("Cannot make {}: {}.", name, error.what()));
    }
}

Result<Image> decode_exr(std::string_view bytes, std::string_view name) {
    return with_exr<Image>(bytes, name, [&](OpenExr& exr) -> Result<Image> {
        if (exr.has("R") && exr.has("G") && exr.has("B")) return read_rgb(exr);
        if (exr.has("Y")) return read_grey(exr);
        return bad_input(fmt::format("{}: has neither the channels R, G, B nor Y.", name));
    });
}

Result<LayeredImage> decode_exr_layers(std::string_view bytes, std::string_view name) {
    return with_exr<LayeredImage>(bytes, name,
                                  [&](OpenExr& exr) -> Result<LayeredImage> { return read_layers(exr); });
}

}  // namespace pathscope
