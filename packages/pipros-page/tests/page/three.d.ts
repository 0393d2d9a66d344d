declare module "three";
declare module "three/addons/*";
