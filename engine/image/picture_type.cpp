#include "image/picture_type.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <iterator>
#include <vector>

#include "image/tiff_directory.h"

namespace trisoup {
namespace {

using namespace std::string_view_literals;

#ifdef TRISOUP_HEIF
constexpr bool kHeif = true;
#else
constexpr bool kHeif = false;
#endif

constexpr std::string_view kDevelop = "convert with darktable-cli IN OUT.tif, or dcraw -T IN",
                           kToneMap = "map its tones to 8 bits and export PNG, for example with darktable or GIMP",
                           kMagick = "convert with magick IN OUT.png";

constexpr PictureType read_type(std::string_view name) { return {name, true, true, ""}; }
constexpr PictureType other_type(std::string_view name, std::string_view remedy, bool read_by_colmap = false) {
  return {name, false, read_by_colmap, remedy};
}
constexpr PictureType heif_type(std::string_view name, std::string_view remedy) {
  return {name, kHeif, false, kHeif ? ""sv : remedy};
}

namespace types {
constexpr PictureType png = read_type("PNG"), jpeg = read_type("JPEG"), webp = read_type("WebP"),
                      tiff = read_type("TIFF"), bmp = read_type("BMP"), pnm = read_type("PPM"), gif = read_type("GIF"),
                      tga = read_type("TGA"), psd = read_type("PSD");
constexpr PictureType heic = heif_type("HEIC", "convert with heif-convert IN OUT.jpg, or build with libheif"),
                      avif = heif_type("AVIF", "convert with heif-convert IN OUT.png, or build with libheif");
constexpr PictureType jpeg_xl = other_type("JPEG XL", "convert with djxl IN OUT.png"),
                      jpeg_2000 = other_type("JPEG 2000", "convert with opj_decompress -i IN -o OUT.png", true),
                      jpeg_ls = other_type("JPEG-LS", kMagick),
                      jpeg_xr = other_type("JPEG XR", "convert with JxrDecApp -i IN -o OUT.tif"),
                      exr = other_type("OpenEXR", kToneMap), hdr = other_type("Radiance HDR", kToneMap),
                      pfm = other_type("PFM", kToneMap), pam = other_type("PAM", kMagick),
                      qoi = other_type("QOI", kMagick), dds = other_type("DDS", kMagick),
                      ktx = other_type("KTX", "convert with ktx extract IN OUT.png"), ico = other_type("ICO", kMagick),
                      pcx = other_type("PCX", kMagick), sgi = other_type("SGI", kMagick),
                      sun = other_type("Sun raster", kMagick), dpx = other_type("DPX", kMagick),
                      fits = other_type("FITS", kMagick), pic = other_type("Softimage PIC", kMagick),
                      xcf = other_type("XCF", "export PNG from GIMP"),
                      flif = other_type("FLIF", "convert with flif -d IN OUT.png"),
                      bpg = other_type("BPG", "convert with bpgdec -o OUT.png IN");
constexpr PictureType raw = other_type("raw photograph", kDevelop), dng = other_type("DNG", kDevelop),
                      cr2 = other_type("Canon CR2", kDevelop), cr3 = other_type("Canon CR3", kDevelop),
                      crw = other_type("Canon CRW", kDevelop), nef = other_type("Nikon NEF", kDevelop),
                      arw = other_type("Sony ARW", kDevelop), raf = other_type("Fujifilm RAF", kDevelop),
                      orf = other_type("Olympus ORF", kDevelop), rw2 = other_type("Panasonic RW2", kDevelop),
                      pef = other_type("Pentax PEF", kDevelop), srw = other_type("Samsung SRW", kDevelop),
                      x3f = other_type("Sigma X3F", kDevelop), mrw = other_type("Minolta MRW", kDevelop),
                      iiq = other_type("Phase One IIQ", kDevelop);
constexpr PictureType svg = other_type("SVG", "convert with rsvg-convert -o OUT.png IN"),
                      pdf = other_type("PDF", "convert with pdftoppm -png IN OUT"),
                      postscript = other_type("PostScript", kMagick),
                      video = other_type("video (MP4, MOV)", "extract pictures with ffmpeg -i IN OUT_%04d.jpg"),
                      web_page = other_type("web page", "download the picture again"),
                      lfs_pointer = other_type("Git LFS pointer", "fetch the picture with git lfs pull"),
                      zip = other_type("ZIP archive", "unpack it"), gzip = other_type("gzip file", "unpack it");
}  // namespace types

struct Signature {
  const PictureType* type;
  std::string_view bytes;
  std::size_t at = 0;
};

// Sources: the specifications of the formats. More specific signatures come first.
constexpr Signature kSignatures[]{
    {&types::png, "\x89PNG\r\n\x1a\n"sv},
    {&types::jpeg_ls, "\xff\xd8\xff\xf7"sv},
    {&types::jpeg, "\xff\xd8\xff"sv},
    {&types::webp, "WEBP"sv, 8},
    {&types::cr2, "CR\x02"sv, 8},
    {&types::tiff, "II*\0"sv},
    {&types::tiff, "MM\0*"sv},
    {&types::tiff, "II+\0"sv},
    {&types::tiff, "MM\0+"sv},
    {&types::gif, "GIF87a"sv},
    {&types::gif, "GIF89a"sv},
    {&types::psd, "8BPS"sv},
    {&types::jpeg_xl, "\xff\x0a"sv},
    {&types::jpeg_xl, "\0\0\0\x0cJXL \r\n\x87\n"sv},
    {&types::jpeg_2000, "\0\0\0\x0cjP  \r\n\x87\n"sv},
    {&types::jpeg_2000, "\xff\x4f\xff\x51"sv},
    {&types::jpeg_xr, "II\xbc\x01"sv},
    {&types::exr, "\x76\x2f\x31\x01"sv},
    {&types::hdr, "#?RADIANCE"sv},
    {&types::hdr, "#?RGBE"sv},
    {&types::crw, "HEAPCCDR"sv, 6},
    {&types::raf, "FUJIFILMCCD-RAW"sv},
    {&types::orf, "IIRO"sv},
    {&types::orf, "IIRS"sv},
    {&types::orf, "MMOR"sv},
    {&types::rw2, "IIU\0"sv},
    {&types::x3f, "FOVb"sv},
    {&types::mrw, "\0MRM"sv},
    {&types::qoi, "qoif"sv},
    {&types::dds, "DDS "sv},
    {&types::ktx, "\xabKTX "sv},
    {&types::ico, "\0\0\x01\0"sv},
    {&types::sgi, "\x01\xda"sv},
    {&types::sun, "\x59\xa6\x6a\x95"sv},
    {&types::dpx, "SDPX"sv},
    {&types::dpx, "XPDS"sv},
    {&types::fits, "SIMPLE  ="sv},
    {&types::pic, "\x53\x80\xf6\x34"sv},
    {&types::xcf, "gimp xcf"sv},
    {&types::flif, "FLIF"sv},
    {&types::bpg, "BPG\xfb"sv},
    {&types::pdf, "%PDF"sv},
    {&types::postscript, "%!PS"sv},
    {&types::lfs_pointer, "version https://git-lfs"sv},
    {&types::zip, "PK\x03\x04"sv},
    {&types::gzip, "\x1f\x8b"sv},
};

struct Extension {
  const PictureType* type;
  std::string_view extension;
};

constexpr Extension kExtensions[]{
    {&types::png, ".png"},       {&types::jpeg, ".jpg"},      {&types::jpeg, ".jpeg"},      {&types::webp, ".webp"},
    {&types::tiff, ".tif"},      {&types::tiff, ".tiff"},     {&types::heic, ".heic"},      {&types::heic, ".heif"},
    {&types::heic, ".hif"},      {&types::avif, ".avif"},     {&types::bmp, ".bmp"},        {&types::bmp, ".dib"},
    {&types::pnm, ".ppm"},       {&types::pnm, ".pgm"},       {&types::pnm, ".pnm"},        {&types::pnm, ".pbm"},
    {&types::gif, ".gif"},       {&types::tga, ".tga"},       {&types::psd, ".psd"},        {&types::jpeg, ".jpe"},
    {&types::jpeg, ".jfif"},     {&types::jpeg, ".jif"},      {&types::jpeg, ".mpo"},       {&types::jpeg_xl, ".jxl"},
    {&types::jpeg_2000, ".jp2"}, {&types::jpeg_2000, ".j2k"}, {&types::jpeg_2000, ".j2c"},  {&types::jpeg_2000, ".jpc"},
    {&types::jpeg_2000, ".jpf"}, {&types::jpeg_2000, ".jpx"}, {&types::jpeg_ls, ".jls"},    {&types::jpeg_xr, ".jxr"},
    {&types::jpeg_xr, ".wdp"},   {&types::jpeg_xr, ".hdp"},   {&types::exr, ".exr"},        {&types::hdr, ".hdr"},
    {&types::hdr, ".rgbe"},      {&types::pfm, ".pfm"},       {&types::pam, ".pam"},        {&types::qoi, ".qoi"},
    {&types::dds, ".dds"},       {&types::ktx, ".ktx"},       {&types::ktx, ".ktx2"},       {&types::ico, ".ico"},
    {&types::pcx, ".pcx"},       {&types::sgi, ".sgi"},       {&types::sun, ".ras"},        {&types::dpx, ".dpx"},
    {&types::fits, ".fits"},     {&types::pic, ".pic"},       {&types::xcf, ".xcf"},        {&types::flif, ".flif"},
    {&types::bpg, ".bpg"},       {&types::dng, ".dng"},       {&types::dng, ".gpr"},        {&types::cr2, ".cr2"},
    {&types::cr3, ".cr3"},       {&types::crw, ".crw"},       {&types::nef, ".nef"},        {&types::nef, ".nrw"},
    {&types::arw, ".arw"},       {&types::arw, ".srf"},       {&types::arw, ".sr2"},        {&types::raf, ".raf"},
    {&types::orf, ".orf"},       {&types::rw2, ".rw2"},       {&types::rw2, ".rwl"},        {&types::pef, ".pef"},
    {&types::srw, ".srw"},       {&types::x3f, ".x3f"},       {&types::mrw, ".mrw"},        {&types::iiq, ".iiq"},
    {&types::raw, ".raw"},       {&types::raw, ".3fr"},       {&types::raw, ".fff"},        {&types::raw, ".dcr"},
    {&types::raw, ".kdc"},       {&types::raw, ".erf"},       {&types::raw, ".mef"},        {&types::raw, ".mos"},
    {&types::svg, ".svg"},       {&types::pdf, ".pdf"},       {&types::postscript, ".eps"}, {&types::postscript, ".ps"},
};

bool is_raw(const PictureType& type) { return type.remedy == kDevelop; }

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Returns the type of a file in the ISO base media format (ISO/IEC 14496-12), which begins with a box that lists the
/// brands of the file.
const PictureType* media_type(std::string_view start) {
  if (start.size() < 12 || start.substr(4, 4) != "ftyp") return nullptr;
  const auto byte = [&](std::size_t i) { return std::size_t(static_cast<unsigned char>(start[i])); };
  const std::size_t box = byte(0) << 24 | byte(1) << 16 | byte(2) << 8 | byte(3);
  bool heif = false;
  for (std::size_t at = 8; at + 4 <= std::min(box, start.size()); at += 4) {
    if (at == 12) continue;  // a version
    const std::string_view brand = start.substr(at, 4);
    if (brand == "crx ") return &types::cr3;
    if (brand == "avif" || brand == "avis") return &types::avif;
    heif = heif || brand.starts_with("hei") || brand.starts_with("hev") || brand == "mif1" || brand == "msf1";
  }
  return heif ? &types::heic : &types::video;
}

/// Returns the type of a file of the PBM family (netpbm.sourceforge.net/doc): P and a digit or letter, then a blank.
const PictureType* pnm_type(std::string_view start) {
  if (start.size() < 3 || start[0] != 'P' || (!std::isspace(static_cast<unsigned char>(start[2])) && start[2] != '#'))
    return nullptr;
  if (start[1] >= '1' && start[1] <= '6') return &types::pnm;
  if (start[1] == '7') return &types::pam;
  if (start[1] == 'F' || start[1] == 'f') return &types::pfm;
  return nullptr;
}

const PictureType* bmp_type(std::string_view start) {
  if (start.size() < 18 || !start.starts_with("BM")) return nullptr;
  // The length of the second header, which tells the versions apart.
  for (const int length : {12, 40, 52, 56, 64, 108, 124})
    if (start[14] == static_cast<char>(length) && start.substr(15, 3) == "\0\0\0"sv) return &types::bmp;
  return nullptr;
}

/// Returns the type of text that is a drawing or a web page.
const PictureType* markup_type(std::string_view start) {
  std::string text(start.substr(0, 1024));
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const std::string_view view = text;
  const std::size_t begin = view.starts_with("\xef\xbb\xbf") ? 3 : 0, first = view.find_first_not_of(" \t\r\n", begin);
  if (first == std::string_view::npos || view[first] != '<') return nullptr;
  if (view.find("<svg", first) != std::string_view::npos) return &types::svg;
  const bool page = view.find("<html", first) != std::string_view::npos || view.substr(first).starts_with("<!doctype");
  return page ? &types::web_page : nullptr;
}

/// Tells raw photographs, whose first directory may be that of a thumbnail, from other TIFF files.
const PictureType& tiff_type(std::span<const std::byte> bytes) {
  constexpr std::uint16_t kSubfileType = 254, kSubDirectories = 330, kDngVersion = 50706;
  const TiffDirectory directory({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  if (directory.has(kDngVersion)) return types::dng;
  const bool reduced = (directory.value(kSubfileType).value_or(0) & 1) != 0;
  return reduced && directory.has(kSubDirectories) ? types::raw : types::tiff;
}

}  // namespace

const PictureType* picture_type(std::span<const std::byte> bytes) {
  const std::string_view start = text_of(bytes);
  for (const Signature& signature : kSignatures) {
    if (start.size() < signature.at || !start.substr(signature.at).starts_with(signature.bytes)) continue;
    if (signature.type == &types::webp && !start.starts_with("RIFF")) continue;
    if (signature.type == &types::cr2 && !start.starts_with("II*") && !start.starts_with("MM")) continue;
    return signature.type == &types::tiff ? &tiff_type(bytes) : signature.type;
  }
  for (const auto of : {&media_type, &pnm_type, &bmp_type, &markup_type})
    if (const PictureType* type = of(start)) return type;
  return nullptr;
}

const PictureType* picture_type(std::span<const std::byte> start, const std::filesystem::path& name) {
  const PictureType* by_content = picture_type(start);
  const PictureType* by_name = picture_type_of_name(name);
  const bool like_tiff = by_content == &types::tiff || by_content == &types::raw;
  if (by_content == nullptr || (like_tiff && by_name != nullptr && is_raw(*by_name))) return by_name;
  return by_content;
}

const PictureType* picture_type_of_name(const std::filesystem::path& name) {
  std::string extension = name.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const auto found = std::find_if(std::begin(kExtensions), std::end(kExtensions),
                                  [&](const Extension& known) { return known.extension == extension; });
  return found != std::end(kExtensions) ? found->type : nullptr;
}

bool is_readable_picture_name(const std::filesystem::path& name) {
  const PictureType* type = picture_type_of_name(name);
  return type != nullptr && type->read;
}

bool is_unread_picture_name(const std::filesystem::path& name) {
  const PictureType* type = picture_type_of_name(name);
  return type != nullptr && !type->read && type != &types::svg && type != &types::pdf && type != &types::postscript;
}

std::string picture_converter(const std::filesystem::path& name) {
  const PictureType* type = picture_type_of_name(name);
  return type != nullptr ? std::string(type->remedy) : std::string();
}

std::span<const std::string_view> readable_picture_extensions() {
  static const std::vector<std::string_view> extensions = [] {
    std::vector<std::string_view> read;
    for (const Extension& known : kExtensions)
      if (known.type->read) read.push_back(known.extension);
    return read;
  }();
  return extensions;
}

}  // namespace trisoup
