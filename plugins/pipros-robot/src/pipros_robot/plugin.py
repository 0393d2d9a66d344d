"""The declaration of perception and navigation; see `pipros.basics.plugins`."""

from pipros.basics.plugins import BETA, EXPERIMENTAL, Plugin

_PERCEPTION = {
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
_NAVIGATION = {
    "kobuki_safety_controller/SafetyControllerNodelet": "safety_controller_node:SafetyNode",
    "yocs_cmd_vel_mux/CmdVelMuxNodelet": "cmd_vel_mux_node:CmdVelMuxNode",
    "yocs_velocity_smoother/VelocitySmootherNodelet": "velocity_smoother_node:SmootherNode",
}

PLUGIN = Plugin(
    "robot",
    "images, point clouds, laser scans and their sensors; navigation for mobile robots",
    limits="pipros_robot.navigation.limits:NavigationLimits",
    offers={
        "disparity_view": "pipros_robot.perception.images.disparity_view:main",
        "planner_limit": "pipros_robot.navigation.move_base.limit_names:meaning",
        "pytest": "pipros_robot.navigation.pytest_world",
        "windows": "pipros_robot.perception.windows.replacement:show_windows_on_page",
    },
    nodelets={
        **{plugin: f"pipros_robot.perception.{target}" for plugin, target in _PERCEPTION.items()},
        **{plugin: f"pipros_robot.navigation.velocities.{target}" for plugin, target in _NAVIGATION.items()},
    },
    features={
        "images, clouds and laser scans": BETA,
        "localization and mapping": BETA,
        "move_base and planners": BETA,
        "lidar drivers": EXPERIMENTAL,
    },
)
