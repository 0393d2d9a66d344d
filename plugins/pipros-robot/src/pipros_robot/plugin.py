"""The declaration of the room `perception`; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

_NODELETS = {
    "depth_image_proc/convert_metric": "images.depth_nodelets:ConvertMetric",
    "depth_image_proc/point_cloud_xyz": "images.depth_nodelets:PointCloudXyz",
    "depth_image_proc/point_cloud_xyzrgb": "images.depth_nodelets:PointCloudXyzrgb",
    "depth_image_proc/register": "images.depth_nodelets:Register",
    "depthimage_to_laserscan/DepthImageToLaserScanNodelet": "laser.depth_to_scan_node:DepthToScanNode",
    "image_proc/debayer": "images.debayer:Debayer",
    "image_proc/rectify": "images.rectify:Rectify",
    "imu_filter_madgwick/ImuFilterNodelet": "imu.nodes:MadgwickNode",
    "laser_filters/scan_to_cloud_filter_chain": "laser.chain_node:ScanToCloudFilterChain",
    "laser_filters/scan_to_scan_filter_chain": "laser.chain_node:ScanToScanFilterChain",
    "pcl/CropBox": "clouds.filter_nodes:CropBox",
    "pcl/EuclideanClusterExtraction": "clouds.segmentation_nodes:EuclideanClusterExtraction",
    "pcl/ExtractIndices": "clouds.filter_nodes:ExtractIndices",
    "pcl/PassThrough": "clouds.filter_nodes:PassThrough",
    "pcl/SACSegmentation": "clouds.segmentation_nodes:SacSegmentation",
    "pcl/StatisticalOutlierRemoval": "clouds.filter_nodes:StatisticalOutlierRemoval",
    "pcl/VoxelGrid": "clouds.filter_nodes:VoxelGrid",
    "pointcloud_to_laserscan/pointcloud_to_laserscan_nodelet": "laser.cloud_to_scan_node:CloudToScanNode",
    "stereo_image_proc/disparity": "images.disparity:Disparity",
    "stereo_image_proc/point_cloud2": "images.stereo_cloud:StereoCloud",
}

ROOM = Room(
    "perception",
    "images, point clouds, laser scans and their sensors",
    offers={
        "disparity_view": "pipros.perception.images.disparity_view:main",
        "windows": "pipros.perception.windows.replacement:show_windows_on_page",
    },
    share=(
        "depth_image_proc",
        "depthimage_to_laserscan",
        "image_proc",
        "imu_complementary_filter",
        "imu_filter_madgwick",
        "laser_assembler",
        "laser_filters",
        "pcl_ros",
        "pointcloud_to_laserscan",
        "rplidar_ros",
        "stereo_image_proc",
        "urg_node",
    ),
    nodelets={plugin: f"pipros.perception.{target}" for plugin, target in _NODELETS.items()},
    extras={"perception": ("pipros[vision]", "scipy>=1.11"), "drivers": ("pyserial>=3.5",)},
)
