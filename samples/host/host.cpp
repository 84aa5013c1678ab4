// The smallest game: opens a pack, plays it in a loop, and says how that goes.
//
//   billow_host PACK                                    in a window
//   billow_host PACK --headless 240 --ppm picture.ppm   240 frames of 1/60 second without one, the last to a file
// Vulkan is set up as any game does, with one frame in flight. What is done with billow is in Game.
#include <algorithm>
#include <array>
#include <billow/billow.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>
#include <vulkan/vulkan_raii.hpp>
#ifdef HOST_WINDOW
#include <GLFW/glfw3.h>
#endif

namespace {

constexpr uint32_t kWidth = 640, kHeight = 480;
const vk::ApplicationInfo kApplication("host", 0, nullptr, 0, VK_API_VERSION_1_3);
constexpr auto kGeneral = vk::ImageLayout::eGeneral;
constexpr auto kAll = vk::PipelineStageFlagBits2::eAllCommands;
const vk::ImageSubresourceRange kWhole(vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1);

struct Options {
  std::string pack, ppm;
  uint32_t frames = 0;  // headless; 0: in a window
  bool zUp = false;
};

// The first device, with what billow needs enabled, and one queue that draws, computes and presents.
struct Gpu {
  vk::raii::Context loader;
  vk::raii::Instance instance;
  vk::raii::PhysicalDevice physical;
  vk::StructureChain<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features,
                     vk::PhysicalDeviceVulkan13Features>
      features;
  vk::raii::Device device = nullptr;
  vk::raii::Queue queue = nullptr;
  uint32_t family = 0;

  explicit Gpu(const std::vector<const char*>& extensions)
      : instance(loader, vk::InstanceCreateInfo({}, &kApplication, {}, extensions)),
        physical(instance.enumeratePhysicalDevices().at(0)) {
    constexpr auto both = vk::QueueFlagBits::eGraphics | vk::QueueFlagBits::eCompute;
    const auto families = physical.getQueueFamilyProperties();
    while (family < families.size() && (families[family].queueFlags & both) != both) ++family;
    if (family == families.size()) throw std::runtime_error("no queue of the device both draws and computes");
    features.get().features.textureCompressionBC = physical.getFeatures().textureCompressionBC;
    features.get<vk::PhysicalDeviceVulkan12Features>().setBufferDeviceAddress(true).setTimelineSemaphore(true);
    features.get<vk::PhysicalDeviceVulkan13Features>().setSynchronization2(true);
    const float priority = 1;
    const vk::DeviceQueueCreateInfo queueInfo({}, family, 1, &priority);
    const std::vector<const char*> names(extensions.empty() ? 0 : 1, VK_KHR_SWAPCHAIN_EXTENSION_NAME);
    device = {physical, vk::DeviceCreateInfo({}, queueInfo, {}, names, nullptr, &features.get())};
    queue = device.getQueue(family, 0);
  }

  vk::raii::DeviceMemory allocate(const vk::MemoryRequirements& needs, vk::MemoryPropertyFlags flags) const {
    const vk::PhysicalDeviceMemoryProperties types = physical.getMemoryProperties();
    uint32_t type = 0;
    while ((needs.memoryTypeBits >> type & 1) == 0 || (types.memoryTypes.at(type).propertyFlags & flags) != flags)
      ++type;
    return {device, vk::MemoryAllocateInfo(needs.size, type)};
  }
};

struct Image {
  vk::raii::Image image;
  vk::raii::DeviceMemory memory = nullptr;
  vk::raii::ImageView view = nullptr;

  Image(const Gpu& gpu, vk::Format format, vk::ImageUsageFlags usage)
      : image(gpu.device, vk::ImageCreateInfo({}, vk::ImageType::e2D, format, {kWidth, kHeight, 1}, 1, 1,
                                              vk::SampleCountFlagBits::e1, vk::ImageTiling::eOptimal, usage)) {
    memory = gpu.allocate(image.getMemoryRequirements(), vk::MemoryPropertyFlagBits::eDeviceLocal);
    image.bindMemory(*memory, 0);
    if (!(usage & vk::ImageUsageFlagBits::eStorage)) return;
    view = {gpu.device, vk::ImageViewCreateInfo({}, *image, vk::ImageViewType::e2D, format, {}, kWhole)};
  }
};

void barrier(const vk::raii::CommandBuffer& commands, vk::Image image, vk::ImageLayout from, vk::ImageLayout to) {
  const vk::AccessFlags2 any = vk::AccessFlagBits2::eMemoryRead | vk::AccessFlagBits2::eMemoryWrite;
  const vk::ImageMemoryBarrier2 change(kAll, any, kAll, any, from, to, 0, 0, image, kWhole);
  commands.pipelineBarrier2(vk::DependencyInfo({}, {}, {}, change));
}

template <class T>
T need(billow::Expected<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

// Open, budget, update, draw.
class Game {
 public:
  Game(const Gpu& gpu, const Options& options)
      : context_(create(gpu)),
        pack_(need(context_.open(options.pack.c_str()))),
        instance_(need(context_.addInstance(pack_.id()))),
        space_(need(context_.createSpace({}))),
        zUp_(options.zUp) {
    const billow::VolumeInfo volume = need(pack_.volume(0));
    for (std::size_t i = 0; i < 3; ++i) {
      center_[i] = (volume.min[i] + volume.max[i]) / 2;
      size_ = std::max(size_, volume.max[i] - volume.min[i]);
    }
    std::printf("%s: %s, %u frames, %.2f s\n", options.pack.c_str(), volume.name, volume.frames, volume.seconds);
  }

  void update(double seconds) {
    time_ += seconds;
    std::array<double, 3> eye = center_;
    eye[0] += 1.8 * size_ * std::sin(0.2 * time_);
    eye[zUp_ ? 1 : 2] += (zUp_ ? -1.8 : 1.8) * size_ * std::cos(0.2 * time_);
    view_ = billow::lookAt(eye, center_, {0, zUp_ ? 0.0 : 1.0, zUp_ ? 1.0 : 0.0}, 40);
    billow::UpdateInfo info;
    info.seconds = seconds;
    info.pixelsHigh = kHeight;
    info.view = &view_;
    need(context_.update(info));
    while (const auto error = context_.takeError()) std::fprintf(stderr, "host: %s\n", error->message);
    const billow::InstanceState state = need(instance_.state());
    const bool late = state.drawable == 0 || state.held != 0;
    played_ += late && played_ == 0 ? 0 : 1;  // counted from the first frame that is there
    late_ += late && played_ > 0 ? 1 : 0;
  }

  void draw(vk::CommandBuffer commands, const Image& color, const Image& depth) {
    billow::DrawInfo info;
    info.space = space_.get();
    info.view = &view_;
    info.width = kWidth, info.height = kHeight;
    info.color = *color.view, info.depth = *depth.view;
    need(context_.draw(commands, info));
  }

  void print() const {
    const billow::Stats stats = context_.stats();
    std::printf("played %u late %u; %u frames resident, %.1f MB of GPU memory, %.1f MB with the space\n", played_,
                late_, stats.framesResident, double(stats.gpuAllocated) / 1e6, double(stats.gpuBytesInAll) / 1e6);
  }

  const billow::Context& context() const { return context_; }

 private:
  static billow::Context create(const Gpu& gpu) {
    billow::Device device;
    device.instance = *gpu.instance, device.physicalDevice = *gpu.physical, device.device = *gpu.device;
    device.getInstanceProcAddr = gpu.instance.getDispatcher()->vkGetInstanceProcAddr;
    device.uploadQueue = *gpu.queue, device.uploadFamily = device.drawFamily = gpu.family;
    device.enabledFeatures = &static_cast<const VkPhysicalDeviceFeatures2&>(gpu.features.get());
    billow::Config config;
    config.framesInFlight = 1;
    config.gpuBudget = uint64_t{128} << 20;
    return need(billow::Context::create(device, config));
  }

  billow::Context context_;
  billow::Pack pack_;
  billow::Instance instance_;
  billow::Space space_;
  billow::View view_;
  std::array<double, 3> center_{};
  double size_ = 0, time_ = 0;
  bool zUp_;
  uint32_t played_ = 0, late_ = 0;
};

// Records and submits a frame into the target, which becomes sRGB, and waits for it.
class Painter {
 public:
  explicit Painter(const Gpu& gpu)
      : gpu_(gpu),
        color_(gpu, vk::Format::eR16G16B16A16Sfloat,
               vk::ImageUsageFlagBits::eStorage | vk::ImageUsageFlagBits::eTransferSrc),
        depth_(gpu, vk::Format::eR32Sfloat, vk::ImageUsageFlagBits::eStorage),
        pool_(gpu.device, vk::CommandPoolCreateInfo({}, gpu.family)),
        commands_(std::move(gpu.device.allocateCommandBuffers({*pool_, vk::CommandBufferLevel::ePrimary, 1})[0])) {}

  void paint(Game& game, vk::Image target, vk::ImageLayout after, vk::Semaphore before = {}, vk::Semaphore done = {},
             vk::Buffer copy = {}) {
    pool_.reset();
    commands_.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
    for (const Image* image : {&color_, &depth_})
      barrier(commands_, *image->image, vk::ImageLayout::eUndefined, kGeneral);
    game.draw(*commands_, color_, depth_);
    barrier(commands_, *color_.image, kGeneral, kGeneral);
    barrier(commands_, target, vk::ImageLayout::eUndefined, kGeneral);
    const vk::ImageSubresourceLayers layer(vk::ImageAspectFlagBits::eColor, 0, 0, 1);
    const std::array<vk::Offset3D, 2> whole{vk::Offset3D(), vk::Offset3D(kWidth, kHeight, 1)};
    commands_.blitImage(*color_.image, kGeneral, target, kGeneral, vk::ImageBlit(layer, whole, layer, whole),
                        vk::Filter::eNearest);
    barrier(commands_, target, kGeneral, after);
    if (copy)
      commands_.copyImageToBuffer(target, after, copy, vk::BufferImageCopy(0, 0, 0, layer, {}, {kWidth, kHeight, 1}));
    commands_.end();
    const billow::Wait uploads = game.context().wait();
    const vk::SemaphoreSubmitInfo waits[]{{uploads.semaphore, uploads.value, kAll}, {before, 0, kAll}},
        signal(done, 0, kAll);
    const vk::CommandBufferSubmitInfo commands(*commands_);
    gpu_.queue.submit2(vk::SubmitInfo2({}, before ? 2 : 1, waits, 1, &commands, done ? 1 : 0, &signal));
    gpu_.queue.waitIdle();
  }

 private:
  const Gpu& gpu_;
  Image color_, depth_;
  vk::raii::CommandPool pool_;
  vk::raii::CommandBuffer commands_;
};

void playHeadless(const Options& options) {
  const Gpu gpu({});
  Game game(gpu, options);
  Painter painter(gpu);
  const Image target(gpu, vk::Format::eR8G8B8A8Srgb,
                     vk::ImageUsageFlagBits::eTransferDst | vk::ImageUsageFlagBits::eTransferSrc);
  const vk::raii::Buffer buffer(gpu.device,
                                vk::BufferCreateInfo({}, kWidth * kHeight * 4, vk::BufferUsageFlagBits::eTransferDst));
  const auto seen = vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent;
  const vk::raii::DeviceMemory memory = gpu.allocate(buffer.getMemoryRequirements(), seen);
  buffer.bindMemory(*memory, 0);
  for (uint32_t i = 0; i < options.frames; ++i) {
    game.update(1.0 / 60);
    painter.paint(game, *target.image, kGeneral, {}, {}, *buffer);
  }
  game.print();
  const auto* texels = static_cast<const char*>(memory.mapMemory(0, VK_WHOLE_SIZE));
  std::ofstream ppm(options.ppm, std::ios::binary);
  ppm << "P6 " << kWidth << ' ' << kHeight << " 255\n";
  for (uint32_t i = 0; i < kWidth * kHeight; ++i) ppm.write(texels + i * 4, 3);
}

void playInWindow(const Options& options) {
#ifdef HOST_WINDOW
  if (glfwInit() != GLFW_TRUE) throw std::runtime_error("no display; use --headless");
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
  GLFWwindow* window = glfwCreateWindow(kWidth, kHeight, options.pack.c_str(), nullptr, nullptr);
  uint32_t count = 0;
  const char** names = glfwGetRequiredInstanceExtensions(&count);
  if (window == nullptr || names == nullptr) throw std::runtime_error("no window for Vulkan; use --headless");
  const Gpu gpu(std::vector<const char*>(names, names + count));
  VkSurfaceKHR made{};
  const VkResult result = glfwCreateWindowSurface(*gpu.instance, window, nullptr, &made);
  const vk::raii::SurfaceKHR surface(gpu.instance, made);
  if (result != VK_SUCCESS || !gpu.physical.getSurfaceSupportKHR(gpu.family, *surface))
    throw std::runtime_error("the device cannot present");
  const vk::raii::SwapchainKHR swapchain(
      gpu.device,
      vk::SwapchainCreateInfoKHR({}, *surface, 3, vk::Format::eB8G8R8A8Srgb, vk::ColorSpaceKHR::eSrgbNonlinear,
                                 {kWidth, kHeight}, 1, vk::ImageUsageFlagBits::eTransferDst));
  const auto images = swapchain.getImages();
  const vk::raii::Semaphore taken(gpu.device, vk::SemaphoreCreateInfo()), drawn(gpu.device, vk::SemaphoreCreateInfo());
  Game game(gpu, options);
  Painter painter(gpu);
  double before = glfwGetTime();
  for (uint32_t frame = 1; glfwWindowShouldClose(window) == GLFW_FALSE; ++frame) {
    const double now = glfwGetTime();
    game.update(now - before);
    before = now;
    const uint32_t image = swapchain.acquireNextImage(UINT64_MAX, *taken).second;
    painter.paint(game, vk::Image(images[image]), vk::ImageLayout::ePresentSrcKHR, *taken, *drawn);
    (void)gpu.queue.presentKHR(vk::PresentInfoKHR(*drawn, *swapchain, image));
    if (frame % 120 == 0) game.print();
    glfwPollEvents();
  }
  gpu.device.waitIdle();
#else
  throw std::runtime_error(options.pack + ": built without GLFW; use --headless");
#endif
}

}  // namespace

int main(int count, char** words) try {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    const auto value = [&] { return std::string(i + 1 < count ? words[++i] : ""); };
    if (word == "--headless") options.frames = static_cast<uint32_t>(std::stoul(value()));
    if (word == "--ppm") options.ppm = value();
    if (word == "--z-up") options.zUp = true;
    if (!word.starts_with("-")) options.pack = word;
    if (word.starts_with("-") && word != "--headless" && word != "--ppm" && word != "--z-up")
      throw std::runtime_error(word + ": unknown option");
  }
  if (options.pack.empty()) throw std::runtime_error("usage: billow_host PACK [--headless N [--ppm FILE]] [--z-up]");
  options.frames > 0 ? playHeadless(options) : playInWindow(options);
} catch (const std::exception& error) {
  std::fprintf(stderr, "billow_host: %s\n", error.what());
  return 1;
}
