// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/scene_import.h"

#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace mlvi {
namespace {

// Reflectance of an 8-bit sRGB value (IEC 61966-2-1).
float Linear(std::uint8_t value) {
  const float s = static_cast<float>(value) / 255.0F;
  return s <= 0.04045F ? s / 12.92F : std::pow((s + 0.055F) / 1.055F, 2.4F);
}

// Square, a power of two: what Texture holds.
std::shared_ptr<const Texture> MakeTexture(const cv::Mat& bgr) {
  int size = 1;
  while (size < std::max(bgr.cols, bgr.rows) && size < 2048) size *= 2;
  cv::Mat square;
  cv::resize(bgr, square, cv::Size(size, size), 0.0, 0.0, cv::INTER_AREA);
  std::vector<Eigen::Vector3f> texels;
  texels.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      const cv::Vec3b pixel = square.at<cv::Vec3b>(row, column);
      texels.emplace_back(Linear(pixel[2]), Linear(pixel[1]), Linear(pixel[0]));
    }
  }
  return std::make_shared<Texture>(size, texels);
}

// A picture within the file (compressed or as plain texels).
cv::Mat Embedded(const aiTexture& texture) {
  if (texture.mHeight == 0) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(texture.pcData);
    return cv::imdecode(std::vector<std::uint8_t>(bytes, bytes + texture.mWidth), cv::IMREAD_COLOR);
  }
  cv::Mat image(static_cast<int>(texture.mHeight), static_cast<int>(texture.mWidth), CV_8UC3);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const aiTexel& texel = texture.pcData[row * image.cols + column];
      image.at<cv::Vec3b>(row, column) = {texel.b, texel.g, texel.r};
    }
  }
  return image;
}

class SceneReader {
 public:
  SceneReader(const aiScene& scene, std::filesystem::path file, const SceneImportOptions& options)
      : scene_(scene), file_(std::move(file)), options_(options) {}

  Expected<TriangleMesh> Read() {
    for (unsigned int i = 0; i < scene_.mNumMaterials; ++i) {
      auto material = ReadMaterial(*scene_.mMaterials[i]);
      if (!material) return tl::unexpected(material.error());
      mesh_.materials.push_back(std::move(*material));
    }
    for (unsigned int i = 0; i < scene_.mNumMeshes; ++i) AddMesh(*scene_.mMeshes[i]);
    if (mesh_.triangles.empty()) {
      return MakeError(ErrorKind::kInput, "{}: no triangle with an area among {} meshes",
                       file_.string(), scene_.mNumMeshes);
    }
    if (const auto ok = CheckExtent(); !ok) return tl::unexpected(ok.error());
    return std::move(mesh_);
  }

 private:
  Expected<Material> ReadMaterial(const aiMaterial& source) const {
    aiString name;
    source.Get(AI_MATKEY_NAME, name);
    Material material{
        .name = name.C_Str(), .reflectivity = options_.reflectivity, .relief = options_.relief};
    aiColor4D colour(0.5F, 0.5F, 0.5F, 1.0F);
    if (source.Get(AI_MATKEY_BASE_COLOR, colour) != aiReturn_SUCCESS)
      source.Get(AI_MATKEY_COLOR_DIFFUSE, colour);
    material.texture.light = material.texture.dark = {colour.r, colour.g, colour.b};
    aiString picture;
    if (source.GetTexture(aiTextureType_BASE_COLOR, 0, &picture) != aiReturn_SUCCESS &&
        source.GetTexture(aiTextureType_DIFFUSE, 0, &picture) != aiReturn_SUCCESS)
      return material;
    const aiTexture* embedded = scene_.GetEmbeddedTexture(picture.C_Str());
    const std::string beside = (file_.parent_path() / picture.C_Str()).string();
    const cv::Mat image = embedded                          ? Embedded(*embedded)
                          : std::filesystem::exists(beside) ? cv::imread(beside, cv::IMREAD_COLOR)
                                                            : cv::Mat();
    if (image.empty()) {
      return MakeError(ErrorKind::kInput, "{}: the picture {} of material '{}' cannot be read",
                       file_.string(), embedded ? "in the file" : beside, material.name);
    }
    material.image = MakeTexture(image);
    material.tile = 1.0;
    material.mapping = TextureMapping::kVertex;
    return material;
  }

  Eigen::Vector3f PointOf(const aiVector3D& v) const {
    const auto s = static_cast<float>(options_.scale);
    if (options_.up == UpAxis::kZ) return s * Eigen::Vector3f(v.x, v.y, v.z);
    return s * Eigen::Vector3f(v.x, -v.z, v.y);
  }

  void AddMesh(const aiMesh& source) {
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (unsigned int i = 0; i < source.mNumVertices; ++i) {
      mesh_.vertices.push_back(PointOf(source.mVertices[i]));
      mesh_.texture_coordinates.emplace_back(0.0F, 0.0F);
      if (!source.HasTextureCoords(0)) continue;
      const aiVector3D& uv = source.mTextureCoords[0][i];
      mesh_.texture_coordinates.back() = {uv.x, uv.y};
    }
    for (unsigned int i = 0; i < source.mNumFaces; ++i) {
      const aiFace& face = source.mFaces[i];
      if (face.mNumIndices != 3) continue;
      const std::array<std::uint32_t, 3> triangle = {
          first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]};
      const Eigen::Vector3f& a = mesh_.vertices[triangle[0]];
      if ((mesh_.vertices[triangle[1]] - a).cross(mesh_.vertices[triangle[2]] - a).norm() < 1e-9F)
        continue;
      mesh_.triangles.push_back(triangle);
      mesh_.triangle_materials.push_back(static_cast<std::uint16_t>(source.mMaterialIndex));
    }
  }

  Expected<void> CheckExtent() const {
    constexpr float kLargest = 10000.0F;  // m
    for (const Eigen::Vector3f& vertex : mesh_.vertices) {
      if (vertex.allFinite() && vertex.norm() < kLargest) continue;
      return MakeError(ErrorKind::kInput,
                       "{}: a vertex at ({}, {}, {}) m; is the scale of {} m per unit right?",
                       file_.string(), vertex.x(), vertex.y(), vertex.z(), options_.scale);
    }
    return {};
  }

  const aiScene& scene_;
  std::filesystem::path file_;
  SceneImportOptions options_;
  TriangleMesh mesh_;
};

}  // namespace

Expected<TriangleMesh> ImportScene(const std::string& path, const SceneImportOptions& options) {
  if (!(options.scale > 0.0)) {
    return MakeError(ErrorKind::kConfiguration, "a scale of {} m per unit; it must be positive",
                     options.scale);
  }
  Assimp::Importer importer;
  // Texture coordinates down the picture, as Texture has them.
  const aiScene* scene = importer.ReadFile(
      path, aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_FlipUVs |
                aiProcess_SortByPType | aiProcess_JoinIdenticalVertices);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    return MakeError(ErrorKind::kInput, "{}: cannot be read as a scene: {}", path,
                     importer.GetErrorString());
  }
  return SceneReader(*scene, path, options).Read();
}

}  // namespace mlvi
